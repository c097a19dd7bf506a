//! The kinds of bodies.

use crate::base::keys::choices;

choices! {
    /// The kind of body.
    pub enum Kind {
        /// The Earth as the WGS-84 ellipsoid. Without a position it is a sphere of the mean radius, and the covariance
        /// includes the unknown latitude.
        @0 Earth = "earth";
        /// A sphere of 6371.0088 km.
        @1 EarthSphere = "earth-sphere";
        /// A disc of 0.2666° half-angle at 1 au; it blooms, so its half-angle is free.
        @2 Sun = "sun";
        /// A disc of about 0.26° half-angle; its half-angle is free.
        @3 Moon = "moon";
        /// A sphere of `radius_km`.
        @4 Sphere = "sphere";
        /// An ellipsoid with the semi-axes `radii_km`.
        @5 Ellipsoid = "ellipsoid" needs "position";
        /// Mercury: 2440.53 km × 2438.26 km.
        @6 Mercury = "mercury" needs "position";
        /// Venus: 6051.8 km.
        @7 Venus = "venus" needs "position";
        /// Mars: 3396.19 km × 3376.20 km.
        @8 Mars = "mars" needs "position";
        /// Jupiter: 71492 km × 66854 km.
        @9 Jupiter = "jupiter" needs "position";
        /// Saturn: 60268 km × 54364 km.
        @10 Saturn = "saturn" needs "position";
        /// Uranus: 25559 km × 24973 km.
        @11 Uranus = "uranus" needs "position";
        /// Neptune: 24764 km × 24341 km.
        @12 Neptune = "neptune" needs "position";
        /// Pluto: 1188.3 km.
        @13 Pluto = "pluto" needs "position";
        /// Ceres: 487.3 km × 446.0 km.
        @14 Ceres = "ceres" needs "position";
        /// Vesta: 289 km × 280 km × 229 km.
        @15 Vesta = "vesta" needs "position";
        /// Phobos: 13.0 km × 11.4 km × 9.1 km.
        @16 Phobos = "phobos" needs "position";
        /// Deimos: 7.8 km × 6.0 km × 5.1 km.
        @17 Deimos = "deimos" needs "position";
        /// Io: 1829.4 km × 1819.4 km × 1815.7 km.
        @18 Io = "io" needs "position";
        /// Europa: 1562.6 km × 1560.3 km × 1559.5 km.
        @19 Europa = "europa" needs "position";
        /// Ganymede: 2631.2 km.
        @20 Ganymede = "ganymede" needs "position";
        /// Callisto: 2410.3 km.
        @21 Callisto = "callisto" needs "position";
        /// Mimas: 207.8 km × 196.7 km × 190.6 km.
        @22 Mimas = "mimas" needs "position";
        /// Enceladus: 256.6 km × 251.4 km × 248.3 km.
        @23 Enceladus = "enceladus" needs "position";
        /// Tethys: 538.4 km × 528.3 km × 526.3 km.
        @24 Tethys = "tethys" needs "position";
        /// Dione: 563.4 km × 561.3 km × 559.6 km.
        @25 Dione = "dione" needs "position";
        /// Rhea: 765.0 km × 763.1 km × 762.4 km.
        @26 Rhea = "rhea" needs "position";
        /// Titan: 2575.15 km × 2574.78 km × 2574.47 km.
        @27 Titan = "titan" needs "position";
        /// Iapetus: 745.7 km × 712.1 km.
        @28 Iapetus = "iapetus" needs "position";
        /// Miranda: 240.4 km × 234.2 km × 232.9 km.
        @29 Miranda = "miranda" needs "position";
        /// Ariel: 581.1 km × 577.9 km × 577.7 km.
        @30 Ariel = "ariel" needs "position";
        /// Umbriel: 584.7 km.
        @31 Umbriel = "umbriel" needs "position";
        /// Titania: 788.9 km.
        @32 Titania = "titania" needs "position";
        /// Oberon: 761.4 km.
        @33 Oberon = "oberon" needs "position";
        /// Triton: 1352.6 km.
        @34 Triton = "triton" needs "position";
        /// Charon: 606.0 km.
        @35 Charon = "charon" needs "position";
    }
}

choices! {
    /// The surface from which an altitude without a position is measured.
    pub enum AltitudeReference {
        /// The WGS-84 ellipsoid, as in satellite navigation.
        ///
        /// If the local radius differs from the mean one, the distance of the camera from the centre differs by the
        /// same amount. The half-angle then shows only the fraction (H − d)/(R + H) of the difference.
        @0 Ellipsoid = "ellipsoid";
        /// A sphere of 6371 km, for example for an altitude computed as orbit radius minus 6371 km; the local radius is
        /// then unknown by about 17 km (1σ).
        @1 Sphere = "sphere";
    }
}
