//! Checks that drawings are readable on a dark system.

/// Lines, dots and letters need at least this contrast to what is below them. Equal colours have the contrast 1.
const LEAST: f64 = 3.0;
/// Lines of a grid are fainter than this, and may be hard to see.
const FAINT: f64 = 0.2;

/// Colour in sRGB, 0 to 255, and opacity, 0 to 1.
type Colour = ([f64; 3], f64);

/// A rule that replaces an attribute of elements: the element (empty for all), an attribute and its value (empty for
/// any), the attribute that is replaced, and its new value.
#[derive(Debug)]
struct Rule<'a> {
    element: &'a str,
    has: Option<(&'a str, &'a str)>,
    replaces: &'a str,
    value: &'a str,
}

/// Returns the rules of all drawings for a dark system, in their order.
fn dark_rules(text: &str) -> Vec<Rule<'_>> {
    let mut out = Vec::new();
    for part in text.split("@media(prefers-color-scheme:dark){").skip(1) {
        let all = part.split("}}").next().unwrap();
        for (selectors, declaration) in all.split('}').filter_map(|rule| rule.split_once('{')) {
            let Some((replaces, value)) = declaration.split_once(':') else { continue };
            for selector in selectors.split(',').filter_map(|s| s.strip_prefix("svg ")) {
                let (element, has) = selector.split_once('[').unwrap_or((selector, ""));
                let has = has.strip_suffix("']").and_then(|has| has.split_once("='"));
                out.push(Rule { element, has, replaces, value });
            }
        }
    }
    out
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    tag.split_once(&format!(" {name}=\""))?.1.split('"').next()
}

fn number(tag: &str, name: &str) -> f64 {
    attribute(tag, name).map_or(0.0, |v| v.trim_end_matches("px").parse().unwrap())
}

/// Returns what an element has for an attribute on a dark system.
fn value<'a>(rules: &[Rule<'a>], tag: &'a str, name: &str) -> Option<&'a str> {
    let element = tag.split([' ', '/']).next().unwrap();
    let is_of = |r: &&Rule<'_>| {
        let has = r.has.is_none_or(|(attr, value)| attribute(tag, attr) == Some(value));
        r.replaces == name && (r.element.is_empty() || r.element == element) && has
    };
    rules.iter().rev().find(is_of).map(|r| r.value).or_else(|| attribute(tag, name))
}

/// Returns the colour that an element has for `fill` or `stroke` on a dark system.
fn colour(rules: &[Rule<'_>], tag: &str, name: &str) -> Option<Colour> {
    let opacity = value(rules, tag, "opacity").map_or(1.0, |v| v.parse::<f64>().unwrap());
    let value = value(rules, tag, name)?;
    let part = |from: usize, len: usize| f64::from(u8::from_str_radix(&value[from..from + len], 16).unwrap());
    match value.len() {
        _ if value == "none" => None,
        7 if value.starts_with('#') => Some(([part(1, 2), part(3, 2), part(5, 2)], opacity)),
        4 if value.starts_with('#') => Some(([1, 2, 3].map(|at| 17.0 * part(at, 1)), opacity)),
        _ => {
            let inner = value.strip_prefix("rgba(").and_then(|v| v.strip_suffix(')'));
            let mut parts = inner.unwrap_or_else(|| panic!("{value}")).split(',').map(|v| v.parse::<f64>().unwrap());
            let [r, g, b, a] = std::array::from_fn(|_| parts.next().unwrap());
            Some(([r, g, b], a * opacity))
        }
    }
}

/// Returns a colour over another one.
fn over((colour, opacity): Colour, ground: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| colour[i] * opacity + ground[i] * (1.0 - opacity))
}

/// Returns the contrast of two colours, as WCAG 2 defines it.
fn contrast(a: [f64; 3], b: [f64; 3]) -> f64 {
    let luminance = |c: [f64; 3]| {
        let [r, g, b] = c.map(|v| if v <= 10.31 { v / 3294.6 } else { ((v / 255.0 + 0.055) / 1.055).powf(2.4) });
        0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
    };
    let (a, b) = (luminance(a), luminance(b));
    (a / b).max(b / a)
}

/// Checks the drawings as a dark system shows them: the ground is dark, and each line, dot and letter stands out from
/// what is below it. Returns the number of checked elements.
pub(crate) fn assert_drawings_are_readable(text: &str) -> usize {
    let rules = dark_rules(text);
    let mut checked = 0;
    for svg in text.split("<svg ").skip(1).map(|rest| rest.split("</svg>").next().unwrap()) {
        let mut areas: Vec<([f64; 4], [f64; 3])> = Vec::new();
        for tag in svg.split('<').skip(1).map(|tag| tag.split('>').next().unwrap()) {
            let element = tag.split([' ', '/']).next().unwrap();
            let at = |p: [f64; 2]| {
                let has = |[x, y, w, h]: [f64; 4]| (x..=x + w).contains(&p[0]) && (y..=y + h).contains(&p[1]);
                areas.iter().rev().find(|(area, _)| has(*area)).or(areas.first()).map(|(_, colour)| *colour)
            };
            let (name, ground) = match element {
                "rect" => {
                    let [x, y, w, h] = ["x", "y", "width", "height"].map(|name| number(tag, name));
                    let below = at([x + 0.5 * w, y + 0.5 * h]).unwrap_or([255.0; 3]);
                    let fill = over(colour(&rules, tag, "fill").unwrap_or_else(|| panic!("{tag}")), below);
                    let is_dark = contrast(fill, [255.0; 3]) > LEAST;
                    assert!(!areas.is_empty() || is_dark, "the ground stays bright: {tag}");
                    areas.push(([x, y, w, h], fill));
                    continue;
                }
                "text" => ("fill", at([number(tag, "x"), number(tag, "y")])),
                "circle" => ("fill", at([number(tag, "cx"), number(tag, "cy")])),
                "line" => ("stroke", at([number(tag, "x1"), number(tag, "y1")])),
                "polyline" => ("stroke", areas.first().map(|(_, colour)| *colour)),
                _ => continue,
            };
            let (ground, drawn) = (ground.unwrap(), colour(&rules, tag, name).unwrap_or_else(|| panic!("{tag}")));
            if drawn.1 > FAINT {
                let ratio = contrast(over(drawn, ground), ground);
                assert!(ratio >= LEAST, "{tag} has the contrast {ratio:.2}");
                checked += 1;
            }
        }
    }
    assert!(checked > 0, "there is no drawing: {text}");
    checked
}

#[test]
fn what_stays_dark_on_a_dark_system_is_noticed() {
    let drawing = |rules: &str| {
        format!(
            "<svg width=\"9\"><style>@media(prefers-color-scheme:dark){{{rules}}}</style><rect x=\"0\" y=\"0\" \
             width=\"9\" height=\"9\" fill=\"#FFFFFF\"/><line stroke=\"#0072b2\" x1=\"1\" y1=\"1\"/></svg>"
        )
    };
    let fails = |rules: &str| std::panic::catch_unwind(|| assert_drawings_are_readable(&drawing(rules))).is_err();
    let ground = "svg rect[fill='#FFFFFF']{fill:#1c1f24}";
    assert!(fails("") && fails(&format!("{ground}svg [stroke='#0072b2']{{stroke:#0a3f60}}")));
    // The value of an attribute is compared letter by letter.
    assert!(fails(&format!("{ground}svg line{{stroke:#333333}}svg [stroke='#0072B2']{{stroke:#6f9bff}}")));
    assert_eq!(assert_drawings_are_readable(&drawing(&format!("{ground}svg [stroke='#0072b2']{{stroke:#6f9bff}}"))), 1);
}
