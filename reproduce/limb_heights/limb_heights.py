"""Computes the height of the Earth's limb in the band of CO2 at 15 um by month and latitude, line by line.

`cargo xtask reproduce limb-heights` runs it in an environment with numpy, scipy and pymsis. It prints the table in km,
one line for a month, and the heights with other filters and other models, from which the sigma follows.
book/theory/limb.md describes the model. `--cell MONTH LATITUDE` prints one height only.

- Air: NRLMSIS 2.1 at medium solar activity, mean of four longitudes at one time of day, so that tides cancel.
- Lines: the nu2 band of CO2, its hot bands and its isotopologues, from band origins and rotational constants. The
  strength of the main band is 8.2e-18 cm per molecule at 296 K. The others follow from the harmonic oscillator and the
  isotopic abundances; the 10001/10002 pair shares its strength 28:22. These numbers are rounded and come from no line
  database, so that 10 % of the strength is a part of the sigma.
- Shape: Voigt, with Lorentz widths of 0.092 to 0.060 cm-1/atm that fall with the rotational number, times (296/T)^0.7.
- Radiance: sum of layers of 2 km along the straight tangent path in local thermal equilibrium, with 420 ppm of CO2.
- Height: where the radiance through the filter is half of its largest value over tangent heights up to 40 km.
"""

import argparse

import numpy as np
import pymsis
from scipy.special import wofz

BOLTZMANN = 1.380649e-23
SECOND_RADIATION_CM_K = 1.438777
LIGHT_M_S = 2.99792458e8
AVOGADRO = 6.02214e23
RADIUS_KM = 6371.0
BAND_STRENGTH_CM = 8.2e-18
NU2_CM = 667.38

# Of each isotopologue: abundance, shift of its nu2 band, mass, step of J in the ground state, energy of nu2.
ISOTOPOLOGUES = [
    (0.9842, 0.0, 44, 2, 667.38),
    (0.01106, -18.90, 45, 2, 648.48),
    (0.003947, -5.01, 46, 1, 662.37),
    (0.00073, -2.65, 45, 1, 664.73),
]
# Of each hot band: origin, energy of its lower state above the ground (None: nu2), statistical weight and l of that
# state, change of l, strength for one molecule relative to the main band, rotational constants below and above, step of
# J, and whether rare isotopologues have it, too.
HOT_BANDS = [
    (667.75, None, 2, 1, 1, 1.0, 0.3909, 0.3913, 1, True),
    (720.80, None, 2, 1, -1, 0.28, 0.3909, 0.3902, 1, True),
    (618.03, None, 2, 1, -1, 0.22, 0.3909, 0.3905, 1, True),
    (668.12, 1335.1, 2, 2, 1, 1.5, 0.3913, 0.3916, 1, False),
    (741.72, 1335.1, 2, 2, -1, 0.25, 0.3913, 0.3907, 1, False),
    (597.34, 1335.1, 2, 2, -1, 0.25, 0.3913, 0.3909, 1, False),
    (647.06, 1285.4, 1, 0, 1, 1.5, 0.3905, 0.3909, 2, False),
    (688.67, 1388.2, 1, 0, 1, 1.5, 0.3902, 0.3907, 2, False),
]
LEVELS_KM = np.arange(0, 111, 2.0)
TANGENTS_KM = np.arange(8, 86, 2.0)


def bands():
    for abundance, shift, mass, step, energy in ISOTOPOLOGUES:
        yield NU2_CM + shift, abundance, 0.0, 1, 0, 1, 1.0, 0.39022, 0.3909, step, mass
        for origin, lower, weight, l, change, part, below, above, hot_step, is_rare in HOT_BANDS:
            if is_rare or abundance > 0.5:
                lower = energy if lower is None else lower
                yield origin + shift, abundance, lower, weight, l, change, part, below, above, hot_step, mass


def all_lines():
    """Returns frequency, band number, rotational energy, Honl-London factor and J of every line, and the bands."""
    lines, of_bands = [], list(bands())
    for number, (origin, _, _, _, l, change, _, below, above, step, _) in enumerate(of_bands):
        j = np.arange(l, 90, step).astype(float)
        s = l * change
        with np.errstate(divide="ignore", invalid="ignore"):
            r = (j + 2 + s) * (j + 1 + s) / (2 * (j + 1))
            q = np.where(j > 0, (j + 1 + s) * (j - s) * (2 * j + 1) / (2 * j * (j + 1)), 0)
            p = np.where(j > 0, (j - 1 - s) * (j - s) / (2 * j), 0)
        rest = j * (j + 1)
        # The upper levels of a Q branch are those of the other parity, with a constant that is 0.0003 larger.
        nu_r = origin + above * (j + 1) * (j + 2) - below * rest - above
        nu_q = origin + (above + 0.0003) * rest - below * rest
        nu_p = origin + above * (j - 1) * j - below * rest
        for weight, nu in ((r, nu_r), (q, nu_q), (p, nu_p)):
            ok = weight > 0
            lines.append(
                np.c_[nu[ok], np.full(ok.sum(), number), below * (rest[ok] - l * l), weight[ok], j[ok]]
            )
    return np.vstack(lines), of_bands


LINES, BANDS = all_lines()
BAND = LINES[:, 1].astype(int)


def vibrational(t):
    e = [1 - np.exp(-SECOND_RADIATION_CM_K * nu / t) for nu in (667.4, 1340.0, 2349.0)]
    return 1 / (e[0] ** 2 * e[1] * e[2])


def strengths(t):
    """Returns the strengths of all lines at a temperature, cm per molecule."""
    boltzmann = LINES[:, 3] * np.exp(-SECOND_RADIATION_CM_K * LINES[:, 2] / t)
    rotation = boltzmann / np.bincount(BAND, boltzmann)[BAND]
    # The lower state has its statistical weight times the Boltzmann factor.
    each = [a * part * g * np.exp(-SECOND_RADIATION_CM_K * e / t) for _, a, e, g, _, _, part, *_ in BANDS]
    of_band = np.array(each)
    stimulated = (1 - np.exp(-SECOND_RADIATION_CM_K * LINES[:, 0] / t)) / (
        1 - np.exp(-SECOND_RADIATION_CM_K * NU2_CM / 296)
    )
    return BAND_STRENGTH_CM * vibrational(296) / vibrational(t) * of_band[BAND] * rotation * stimulated


def absorption(nu, t, atm):
    """Returns the cross-section at the frequencies, cm2 per molecule."""
    s, out = strengths(t), np.zeros(len(nu))
    mass = np.array([band[-1] for band in BANDS])[BAND] * 1e-3 / AVOGADRO
    doppler = LINES[:, 0] * np.sqrt(2 * BOLTZMANN * t / mass) / LIGHT_M_S
    per_atm = np.interp(LINES[:, 4], [0, 10, 20, 40, 60, 90], [0.092, 0.081, 0.075, 0.069, 0.064, 0.06])
    lorentz = per_atm * atm * (296 / t) ** 0.7
    first, last = np.searchsorted(nu, LINES[:, 0] - 8), np.searchsorted(nu, LINES[:, 0] + 8)
    for i in np.where(s > s.max() * 1e-6)[0]:
        x = nu[first[i] : last[i]] - LINES[i, 0]
        shape = lorentz[i] / np.pi / (x * x + lorentz[i] ** 2)
        near = np.abs(x) < 30 * doppler[i]
        if near.any():
            shape[near] = wofz((x[near] + 1j * lorentz[i]) / doppler[i]).real / (doppler[i] * np.sqrt(np.pi))
        out[first[i] : last[i]] += s[i] * shape
    return out


class Absorption:
    """The logarithm of the cross-section, on a grid of pressures and temperatures."""

    # One random frequency in each of 5200 equal intervals: the mean over a filter is right to 1 %, or 0.1 km.
    def __init__(self, low_cm=605.0, high_cm=735.0, number=5200):
        draw = np.random.default_rng(15).random(number)
        self.nu = low_cm + (high_cm - low_cm) * (np.arange(number) + draw) / number
        self.log_atm = np.arange(np.log(1e-8), np.log(1.01) + 0.01, 0.65)
        self.t = np.array([160.0, 200.0, 245.0, 300.0])
        self.log = np.log(
            np.array([[absorption(self.nu, t, np.exp(p)) for t in self.t] for p in self.log_atm]) + 1e-40
        )

    def at(self, t, atm):
        x = np.clip((np.log(atm) - self.log_atm[0]) / (self.log_atm[1] - self.log_atm[0]), 0, len(self.log_atm) - 1.001)
        i, t = int(x), np.clip(t, 150, 330)
        j = int(np.clip(np.searchsorted(self.t, t) - 1, 0, 2))
        h = (t - self.t[j]) / (self.t[j + 1] - self.t[j])
        low, high = (self.log[k, j] * (1 - h) + self.log[k, j + 1] * h for k in (i, i + 1))
        return np.exp(low * (1 - (x - i)) + high * (x - i))


def atmosphere(date, latitude, longitudes=(0.0, 90.0, 180.0, 270.0), activity=120.0):
    """Returns temperature (K) and number density (1/cm3) on the levels."""
    data = pymsis.calculate(np.datetime64(date), list(longitudes), [latitude], LEVELS_KM, activity, activity, [[8] * 7])
    data = data.reshape(len(longitudes), len(LEVELS_KM), -1).mean(axis=0)
    return data[:, 10], np.nansum(data[:, 1:9], axis=1) * 1e-6


def radiance(table, t, density, ppm=420.0):
    """Returns the radiance by tangent height and frequency."""
    atm = density * 1e6 * BOLTZMANN * t / 101325
    # Above 80 km the air is no longer mixed.
    mixing = ppm * 1e-6 * np.where(LEVELS_KM > 80, np.exp(-(LEVELS_KM - 80) / 20), 1)
    k = np.log(np.array([table.at(*x) for x in zip(t, atm)])) + np.log(density * mixing * 1e5)[:, None]
    nu = table.nu[None]
    planck = nu**3 / (np.exp(SECOND_RADIATION_CM_K * nu / t[:, None]) - 1)
    out = []
    for tangent in TANGENTS_KM:
        edges = tangent + np.array([0, 0.2, 0.5, 1.0])
        edges = np.concatenate([edges, np.arange(tangent + 2, LEVELS_KM[-1] - 0.1, 2.0)])
        s = np.sqrt((RADIUS_KM + edges) ** 2 - (RADIUS_KM + tangent) ** 2)
        middle = np.sqrt(((s[1:] + s[:-1]) / 2) ** 2 + (RADIUS_KM + tangent) ** 2) - RADIUS_KM
        i = np.clip((middle / 2).astype(int), 0, len(LEVELS_KM) - 2)
        f = (middle / 2 - i)[:, None]
        tau = np.exp(k[i] * (1 - f) + k[i + 1] * f) * np.diff(s)[:, None]
        source = planck[i] * (1 - f) + planck[i + 1] * f
        # From the camera inwards to the tangent point, and out again on the far side.
        both, sources = np.vstack([tau[::-1], tau]), np.vstack([source[::-1], source])
        left = np.exp(-np.vstack([0 * tau[:1], np.cumsum(both, 0)]))
        out.append(((left[:-1] - left[1:]) * sources).sum(0))
    return np.array(out)


def half_level_km(profile):
    half = 0.5 * profile[TANGENTS_KM <= 40].max()
    i = np.where(profile > half)[0][-1]
    return TANGENTS_KM[i] + 2 * (profile[i] - half) / (profile[i] - profile[i + 1])


def trapezium(table, low_um, high_um, soft_um):
    um = 1e4 / table.nu
    return np.clip((um - low_um) / soft_um + 0.5, 0, 1) * np.clip((high_um - um) / soft_um + 0.5, 0, 1)


def filters(table):
    return {
        "14 to 16 um": trapezium(table, 14, 16, 0.4),
        "14 to 16 um with sharp edges": trapezium(table, 14, 16, 0.01),
        "13.7 to 16.3 um": trapezium(table, 13.7, 16.3, 0.3),
        "14 to 16.25 um": trapezium(table, 14, 16.25, 0.3),
        "14.2 to 15.8 um": trapezium(table, 14.2, 15.8, 0.4),
        "14.5 to 15.5 um": trapezium(table, 14.5, 15.5, 0.3),
        "triangle of 14 to 16 um": np.clip(1 - np.abs(1e4 / table.nu - 15), 0, 1),
    }


LATITUDES = range(-90, 91, 15)


def middle_of(month):
    return f"2019-{month:02d}-15T12:00"


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--cell", nargs=2, type=int, metavar=("MONTH", "LATITUDE"))
    chosen = arguments.parse_args()
    table = Absorption()
    usual = filters(table)["14 to 16 um"]

    def height(month, latitude, weights=usual, change_t=0.0, ppm=420.0, strength=1.0):
        t, density = atmosphere(middle_of(month), latitude)
        # A stronger band absorbs as more molecules do.
        return half_level_km(radiance(table, t + change_t, density, ppm * strength) @ weights)

    if chosen.cell:
        print(height(*chosen.cell))
        return
    by_month = [[round(height(month, latitude), 2) for latitude in LATITUDES] for month in range(1, 13)]
    seasons = [(month, latitude) for month in (1, 4, 7, 10) for latitude in (-60, 0, 60)]
    spectra = [radiance(table, *atmosphere(middle_of(month), latitude)) for month, latitude in seasons]
    mean = lambda weights: round(float(np.mean([half_level_km(r @ weights) for r in spectra])), 2)  # noqa: E731
    by_filter = {name: mean(weights) for name, weights in filters(table).items()}
    models = {
        "as in the table": height(4, 30),
        "air 5 K warmer": height(4, 30, change_t=5.0),
        "band 10 % stronger": height(4, 30, strength=1.1),
        "380 ppm of CO2": height(4, 30, ppm=380.0),
    }
    for row in by_month:
        print("table", *row, sep=",")
    for name, height_km in by_filter.items():
        print("filter", name, height_km, sep=",")
    for name, height_km in models.items():
        print("model", name, round(height_km, 2), sep=",")


if __name__ == "__main__":
    main()
