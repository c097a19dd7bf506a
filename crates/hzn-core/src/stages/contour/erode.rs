//! Edges by erosion (Barf 2014, 2.2.3). A lit pixel with too few lit pixels around it would be eroded, so it is an edge
//! pixel.
//!
//! The method reads every pixel of the picture with its whole neighbourhood. It follows no border: all edge pixels of
//! the picture are in one list. To give them an order along the limb, they are sorted by their angle about the centre
//! of the circle through all of them. The order begins after the widest gap.

use super::order::sort_about_common_circle;
use super::thinned::Thinned;
use super::{BinaryPicture, Config};
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::work::{self, WorkBudget};

/// Returns the edge pixels of the picture, sorted by their angle about the common circle. Pixels next to the end of the
/// region or to a mask are no edge pixels.
pub(crate) fn edges<'a, T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    config: &Config,
    buffer: &'a mut [Pixel],
    work: &mut WorkBudget,
) -> Thinned<'a> {
    let mut edge = Thinned::new(buffer);
    let reach = config.erode_size_px / 2;
    let least = config.erode_threshold;
    let around = work::square_cost(config.erode_size_px, binary.mask_cost());
    for y in 0..binary.region.height() {
        let Some((x0, x1)) = binary.region.row_span(y) else { continue };
        // This includes the mask reads of the previous row.
        if !work.try_spend(u32::from(x1 - x0) + binary.cost()) {
            break;
        }
        for x in x0..=x1 {
            let inside = binary.lit(x, y) && binary.region.is_inside_by(x, y, reach);
            if inside && work.try_spend(around) && is_edge(binary, x, y, reach, least) {
                edge.push(Pixel { x, y });
            }
        }
    }
    if work.try_spend(edge.pixels().len() as u32 * work::ORDER) {
        // The later stages need the order, because the distance between neighbours decides how far their errors are
        // correlated.
        sort_about_common_circle::<T>(edge.pixels_mut());
    }
    edge
}

/// Returns whether fewer than `least` pixels of the neighbourhood are lit, and none is masked.
fn is_edge<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: u16,
    y: u16,
    reach: u16,
    least: u16,
) -> bool {
    let mut lit = 0;
    for v in y - reach..=y + reach {
        for u in x - reach..=x + reach {
            // The outline of a mask is no edge, so a masked neighbour takes the pixel out.
            if binary.region.masked(u, v) {
                return false;
            }
            lit += u16::from(binary.lit(u, v));
        }
    }
    lit < least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::region::Region;
    use crate::image::{Grey, Layout};
    use crate::model::observer::Unobserved;
    use std::vec;
    use std::vec::Vec;

    fn eroded(data: &[u8], w: u16, h: u16, size: u16, threshold: u16) -> Vec<(u16, u16)> {
        let picture = Grey::try_new(data, Layout::packed(w.into(), h.into(), 1, 8)).unwrap();
        let region = Region::<f64>::whole(w, h);
        let binary = BinaryPicture::new(&picture, &region, 128, &Unobserved);
        let mut buffer = vec![Pixel::default(); 4096];
        let config = Config { erode_size_px: size, erode_threshold: threshold, ..Config::default() };
        edges(&binary, &config, &mut buffer, &mut WorkBudget::unlimited()).pixels().iter().map(|p| (p.x, p.y)).collect()
    }

    #[test]
    fn a_straight_edge_is_as_wide_as_the_neighbourhood_reaches() {
        let data: Vec<u8> = (0..20 * 20).map(|i| if i / 20 >= 8 { 200 } else { 0 }).collect();
        // In the first row of a straight edge, six of 3×3 pixels are lit; in the second row, all nine.
        let first: Vec<_> = (1..19).map(|x| (x, 8)).collect();
        assert_eq!(eroded(&data, 20, 20, 3, 9), first);
        assert_eq!(eroded(&data, 20, 20, 3, 6), []);
        // With 5×5 pixels, fifteen are lit in the first row, twenty in the second, and all in the third.
        assert_eq!(eroded(&data, 20, 20, 5, 25).len(), 2 * 16);
        assert_eq!(eroded(&data, 20, 20, 5, 20).len(), 16);
    }

    #[test]
    fn points_of_an_arc_are_in_order_along_it() {
        let (w, h, cx, cy, r) = (90u16, 60u16, 40.0, 80.0, 60.0);
        let data: Vec<u8> = (0..u32::from(w) * u32::from(h))
            .map(|i| {
                let (x, y) = (f64::from(i % u32::from(w)), f64::from(i / u32::from(w)));
                if libm::hypot(x - cx, y - cy) < r { 200 } else { 0 }
            })
            .collect();
        let edge = eroded(&data, w, h, 3, 9);
        assert!(edge.len() > 60);
        let along: Vec<f64> = edge.iter().map(|p| libm::atan2(f64::from(p.1) - cy, f64::from(p.0) - cx)).collect();
        // The points go from left to right, without the gap below the picture. Neighbours are one or two pixels apart.
        assert!(along.is_sorted_by(|a, b| *a <= *b + 0.01), "{along:?}");
        for pair in edge.windows(2) {
            assert!(pair[0].0.abs_diff(pair[1].0) <= 4 && pair[0].1.abs_diff(pair[1].1) <= 4, "{pair:?}");
        }
    }
}
