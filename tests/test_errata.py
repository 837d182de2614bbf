"""Errata: the printed formulas are wrong, the corrected ones are right, and the page covers all that is listed."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from numpy.polynomial.polynomial import polyval2d

from fsiwork.studies import errata, errata_chapter1
from fsiwork.studies.errata_chapter1 import PHI, Ring, cut_off

CONFIGS = Path(__file__).resolve().parents[1] / "configs"


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    keys = errata.formulas()
    found = [errata.residual(None, {"formula": key}) for key in keys]
    return xr.Dataset({name: ("formula", [q[name] for q in found]) for name in found[0]}, {"formula": keys})


@pytest.mark.parametrize("key", errata.formulas())
def test_the_print_is_wrong_and_the_correction_right(key, data):
    one = data.sel(formula=key)
    assert one["printed"] >= 1e-3
    if errata.LINES[key].order:
        assert one["order"] >= errata.LINES[key].order
        assert one["corrected"] < 1e-2 * one["printed"]
    else:
        assert one["corrected"] <= 1e-10


def test_the_study_covers_what_is_listed():
    study = yaml.safe_load((CONFIGS / "studies" / "errata.yaml").read_text(encoding="utf-8"))
    assert study["axes"]["formula"] == errata.formulas()
    assert len(errata.formulas()) >= 18
    for key, line in errata.LINES.items():
        assert line.rated in "ABC"
        assert (line.rated in "AB") == (line.residuals is not None) or key == "table-1.1"


def test_the_checks_see_what_is_missing_or_wrong(data):
    good = errata.errata({"errata": data})
    assert good["missing"] == 0
    assert good["order_above"] > 0
    assert errata.errata({"errata": data.isel(formula=slice(1, None))})["missing"] == 1
    swapped = data.rename(printed="corrected", corrected="printed")
    wrong = errata.errata({"errata": swapped})
    assert wrong["printed_least"] < 1e-3
    assert wrong["corrected_largest"] > 1e-10
    hidden = data.copy(deep=True)
    hidden["corrected"][3] = np.nan
    assert np.isnan(errata.errata({"errata": hidden})["corrected_largest"])


def test_a_flipped_sign_is_seen(monkeypatch):
    right = Ring.curvature
    monkeypatch.setattr(Ring, "curvature", lambda ring: -right(ring))
    assert errata_chapter1.contours()[1] > 1e-3
    assert errata_chapter1.tension_force()[1] > 1e-3


def test_the_page_has_a_line_for_each_erratum(data):
    header, lines = errata.rows({"errata": data}, {})
    assert len(lines) == len(errata.LINES)
    assert {len(line) for line in lines} == {len(header)}
    assert all(bool(line[4]) == bool(line[7]) for line in lines)  # a residual and the words what it is


def test_sums_over_the_ring_are_exact():
    """The curvature of a closed line is 2π in all; n·∫ of a divergence vanishes."""
    ring = Ring()
    phi, gradient = polyval2d(ring.x, ring.y, PHI), ring.gradient(PHI)
    slope = np.hypot(*gradient)
    assert ring.sum(cut_off(phi) * slope * ring.curvature()) == pytest.approx(2 * np.pi, rel=1e-13)
    for g in gradient:
        assert ring.sum(cut_off(phi) * g) == pytest.approx(0, abs=1e-13)
