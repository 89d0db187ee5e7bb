"""Beliefs as bytes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.algorithms.idsq_payload import BeliefCoder, BeliefForms
from netsim.algorithms.idsq_positions import BITMAP, LIST, RUNS, laid_positions, read_positions
from netsim.kernels.belief_fit import Mixture, divergence_bit, on_grid
from netsim.kernels.grid_belief import Grid, GridBelief, uniform

GRID = Grid((0.0, 0.0), 5.0, 30, 40)
PRECISIONS = ("float64", "float32", "float16", "uint8")
COMPRESSIONS = ("none", "run_length", "image", "best")


def cloud(sd_m: float = 15.0) -> GridBelief:
    """A belief as trackers have them: one blob without what is below a threshold."""
    blob = on_grid(Mixture(np.ones(1), np.array([[70.0, 90.0]]), np.array([[sd_m**2, 0.3 * sd_m**2, sd_m**2]])), GRID)
    kept = blob.probability > 2e-5
    return GridBelief(GRID, blob.cells[kept], blob.probability[kept] / blob.probability[kept].sum())


@st.composite
def beliefs(draw):
    rng = np.random.default_rng(draw(st.integers(0, 100_000)))
    cells = np.sort(rng.choice(GRID.size, rng.integers(1, 200), replace=False))
    weights = 10.0 ** rng.uniform(-draw(st.sampled_from([0.1, 5.0, 12.0, 300.0])), 0.0, len(cells))
    return GridBelief(GRID, cells, weights / weights.sum())


@given(beliefs(), st.sampled_from([LIST, BITMAP, RUNS]))
@settings(max_examples=40, deadline=None)
def test_cells_survive_in_every_layout(belief, kind):
    data = laid_positions(belief.cells, GRID, kind)
    cells, used = read_positions(data + b"rest", GRID, kind)
    np.testing.assert_array_equal(cells, belief.cells)
    assert used == len(data)


@given(beliefs(), st.sampled_from(PRECISIONS), st.sampled_from(COMPRESSIONS))
@settings(max_examples=60, deadline=None)
def test_a_grid_belief_survives_as_well_as_its_precision_allows(belief, precision, compression):
    coder = BeliefCoder(GRID, precision, BeliefForms(compression=compression))
    laid = coder.encode(belief)
    decoded = coder.decode(laid.data)
    np.testing.assert_array_equal(decoded.cells, belief.cells)
    assert decoded.probability.sum() == pytest.approx(1.0)
    assert np.all(decoded.probability > 0.0)
    assert laid.divergence_bit == divergence_bit(belief, decoded)
    if precision == "uint8":
        spread = float(np.log2(belief.probability.max() / belief.probability.min()))
        assert laid.divergence_bit <= max(spread, 1.0) * 1.002 / 252
    elif precision != "float16":  # what is far below the greatest is lifted by float16
        assert laid.divergence_bit < 1e-6


def test_float64_is_exact_up_to_scale():
    belief = cloud()
    decoded = BeliefCoder(GRID, "float64").decode(BeliefCoder(GRID, "float64").encode(belief).data)
    np.testing.assert_allclose(decoded.probability, belief.probability, rtol=1e-14)


def test_fewer_bits_and_better_layouts_are_shorter():
    belief = cloud()
    sizes = [len(BeliefCoder(GRID, precision).encode(belief).data) for precision in PRECISIONS]
    assert sizes == sorted(sizes, reverse=True)
    lengths = {
        name: len(BeliefCoder(GRID, "uint8", BeliefForms(compression=name)).encode(belief).data)
        for name in COMPRESSIONS
    }
    assert lengths["image"] <= lengths["best"] <= lengths["run_length"] < lengths["none"]


def test_deflating_pays_on_a_large_smooth_belief():
    belief = cloud(sd_m=60.0)
    best, image = (
        len(BeliefCoder(GRID, "uint8", BeliefForms(compression=c)).encode(belief).data) for c in ("best", "image")
    )
    assert image < 0.9 * best


def test_the_shortest_form_that_loses_little_enough_is_sent():
    belief, all_forms = cloud(), ("grid", "gaussian", "mixture")
    normal = BeliefCoder(GRID, "uint8", BeliefForms(forms=all_forms, most_divergence_bit=0.1)).encode(belief)
    assert (normal.form, len(normal.data)) == ("gaussian", 21)
    assert normal.divergence_bit <= 0.1
    strict = BeliefCoder(GRID, "uint8", BeliefForms(forms=all_forms, most_divergence_bit=0.0)).encode(belief)
    assert strict.form == "grid"
    plain = BeliefCoder(GRID, "uint8").encode(belief)
    assert strict.data == plain.data
    assert plain.operations < normal.operations < strict.operations  # whatever was tried is charged
    two = GridBelief(GRID, np.array([100, 101, 130, 900, 901, 930]), np.array([0.2, 0.1, 0.2, 0.2, 0.1, 0.2]))
    assert BeliefCoder(GRID, "uint8", BeliefForms(forms=all_forms)).encode(two).form == "grid"  # six cells are shortest


def test_two_blobs_go_as_a_mixture():
    means_m = np.array([[40.0, 40.0], [110.0, 160.0]])
    belief = on_grid(Mixture(np.array([0.4, 0.6]), means_m, np.tile([200.0, 0.0, 200.0], (2, 1))), GRID)
    kept = belief.probability > 2e-5
    belief = GridBelief(GRID, belief.cells[kept], belief.probability[kept] / belief.probability[kept].sum())
    laid = BeliefCoder(GRID, "uint8", BeliefForms(forms=("gaussian", "mixture"))).encode(belief)
    assert (laid.form, len(laid.data)) == ("mixture", 49)


@given(st.binary(max_size=300))
@settings(max_examples=200, deadline=None)
def test_foreign_bytes_are_a_belief_or_refused(data):
    try:
        belief = BeliefCoder(GRID).decode(data)
    except ValueError:
        return
    assert belief.probability.sum() == pytest.approx(1.0)
    assert np.all((belief.cells >= 0) & (belief.cells < GRID.size))


@given(st.sampled_from(COMPRESSIONS), st.sampled_from(PRECISIONS), st.floats(0.0, 0.999))
@settings(max_examples=40, deadline=None)
def test_a_belief_cut_short_is_refused(compression, precision, share):
    data = BeliefCoder(GRID, precision, BeliefForms(compression=compression)).encode(cloud()).data
    with pytest.raises(ValueError, match=r"bytes|cells"):
        BeliefCoder(GRID).decode(data[: int(share * len(data))])


def test_a_grid_of_too_many_cells_is_refused():
    with pytest.raises(ValueError, match="at most 65,535 can be sent"):
        BeliefCoder(Grid((0.0, 0.0), 1.0, 300, 300))


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_uniform_belief_on_the_largest_grid_survives(compression):
    belief = uniform(Grid((0.0, 0.0), 1.0, 255, 257))
    coder = BeliefCoder(belief.grid, "uint8", BeliefForms(compression=compression))
    decoded = coder.decode(coder.encode(belief).data)
    np.testing.assert_array_equal(decoded.cells, belief.cells)
    np.testing.assert_allclose(decoded.probability, belief.probability)
    with pytest.raises(ValueError, match="65,536 cells"):
        BeliefCoder(Grid((0.0, 0.0), 1.0, 256, 256))
