"""Order of first spikes and population rate: counted afferents and contents of the figures."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.core.errors import InputError
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014.three_levels import resting_response, sheet
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.fingertip import Fingertip
from sections import CURVATURE_PER_M, RESTLESS, SENSITIVE, SKINS, SphereSkin, typed
from studies import population_timing
from studies.pages import population_timing as page
from studies.pages.markdown import write_markdown
from studies.population_timing import PopulationTiming, PopulationTimingStudy


@pytest.fixture(scope="module")
def sheet_answers():
    population = sheet(SENSITIVE)
    return {
        "standard": population.respond(SphereSkin(0.0, 287.0)),
        "curved": population.respond(SphereSkin(0.0, 365.0)),
        "moved": population.respond(SphereSkin(1.0, 287.0)),
    }


def test_a_moved_sphere_changes_who_comes_first_and_a_more_curved_one_only_when(sheet_answers):
    """These skins are functions of the distance from the middle: every curvature has the same order."""
    found = population_timing.recruitment(sheet_answers, area_per_afferent_mm2=0.0625)
    standard, curved, moved = found.touches
    assert (standard.rank_correlation, standard.swapped) == (pytest.approx(1.0), 0.0)
    # Equal distances may come out of the exponential a bit apart, one touch's order of them being another's.
    assert curved.swapped < 0.01
    assert curved.rank_correlation > 0.999
    assert curved.median_ms != standard.median_ms
    assert moved.swapped > 0.1
    assert moved.rank_correlation < 0.9
    latency = sheet_answers["moved"].first_spike_latency_ms
    assert moved.recruited_mm2 == np.isfinite(latency).sum() / 16
    assert moved.recruited_in_ramp_mm2 == (latency <= 50.0).sum() / 16
    assert moved.first_ms == np.nanmin(latency)
    np.testing.assert_array_equal(found.afferents[2].first_spike_latency_ms, latency)


def test_rings_about_the_sphere_hold_all_spikes_near_it(sheet_answers):
    found = population_timing.population_rates(sheet_answers, (RECEPTOR_X_MM, 0.0), density_per_cm2=100.0)
    away = np.hypot(*(sheet_answers["standard"].positions_mm - [RECEPTOR_X_MM, 0.0]).T)
    for touch in found.touches:
        trains = sheet_answers[touch.name].spikes
        total = sum(trains[afferent].size for afferent in np.flatnonzero(away < 4.0))
        spikes = touch.rate_hz * np.diff(found.edges_ms) / 1000.0 * found.n_afferents[:, None]
        assert total > 0
        np.testing.assert_allclose(spikes.sum(), total, rtol=1e-9)
        # 100 per cm2 on the skin of all rings fire as often as the mean afferent of them, a hundredfold.
        mean_hz = spikes.sum(axis=0) / found.n_afferents.sum() / np.diff(found.edges_ms) * 1000.0
        np.testing.assert_allclose(touch.together_per_cm2_hz, 100.0 * mean_hz, rtol=1e-9)
        ring = np.flatnonzero((away >= 1.0) & (away < 2.0))
        firing = [((trains[afferent] > 500.0) & (trains[afferent] <= 510.0)).any() for afferent in ring]
        assert touch.active_fraction.shape == (4, 100)
        assert touch.active_fraction[1, 50] == np.mean(firing)


def test_timing_uses_every_sphere_over_the_middle_and_the_standard_beside_it():
    found = population_timing.population_timing(SKINS, SENSITIVE)
    names = [touch.name for touch in found.recruitment.touches]
    assert names == [*(f"{curvature:g} /m" for curvature in CURVATURE_PER_M), "287 /m, 0.2 mm away"]
    assert [touch.name for touch in found.rates.touches] == ["287 /m", "365 /m"]
    population = population_timing.disc(Fingertip(), SENSITIVE)
    shown = found.recruitment.afferents
    assert [touch.name for touch in shown] == ["287 /m", "365 /m", "287 /m, 0.2 mm away"]
    for touch, key in zip(shown, ((0.0, 287.0), (0.0, 365.0), (0.2, 287.0)), strict=True):
        latency = population.respond(SKINS[key]).first_spike_latency_ms
        np.testing.assert_array_equal(touch.first_spike_latency_ms, latency)
    # Rings are those about the contact point on the curved skin.
    away = np.linalg.norm(population.positions_mm - Fingertip().skin_point(RECEPTOR_X_MM, 0.0), axis=1)
    np.testing.assert_array_equal(found.rates.n_afferents, np.histogram(away, population_timing.RINGS_MM)[0])


def test_the_disc_has_its_density_on_the_skin_itself():
    """A round patch of skin holds its area times the density, however far it turns to the side."""
    population = population_timing.disc(Fingertip(), SENSITIVE)
    assert abs(len(population) / (np.pi * 5.0**2 * 16.0) - 1.0) < 0.01
    along, around = population.places_mm.T
    assert np.hypot(along, around).max() <= 5.0
    # The plane is true to area; seen from below, the rim is foreshortened.
    z = population.positions_mm[:, 2]
    assert np.abs(z).max() < 0.97 * np.abs(around).max()


def test_spikes_without_a_touch_recruit_no_afferent():
    latency = resting_response(RESTLESS).first_spike_latency_ms
    answer = sheet(RESTLESS).respond(SphereSkin(0.0, 287.0))
    assert np.isfinite(answer.first_spike_latency_ms).all()
    found = population_timing.recruitment({"standard": answer}, 0.0625, resting_latency_ms=latency)
    early = (answer.first_spike_latency_ms <= latency / 2).sum()
    assert 0 < early < answer.first_spike_latency_ms.size
    assert found.touches[0].recruited_mm2 == early / 16
    everybody = population_timing.recruitment({"standard": answer}, 0.0625).touches[0]
    assert everybody.recruited_mm2 == answer.first_spike_latency_ms.size / 16


def test_answers_of_other_afferents_are_refused(sheet_answers):
    other = sheet(SENSITIVE, reach_mm=1.0).respond(SphereSkin(0.0, 287.0))
    with pytest.raises(InputError, match="those of 'other' are at other positions than those of 'one'"):
        population_timing.recruitment({"one": sheet_answers["standard"], "other": other}, 0.0625)
    with pytest.raises(InputError, match="at least one touch"):
        population_timing.population_rates({}, (17.37, 0.0), 100.0)
    with pytest.raises(InputError, match="area_per_afferent_mm2 must be greater than 0"):
        population_timing.recruitment(sheet_answers, 0.0)


# The page


def timing_section():
    x, z = np.linspace(12.0, 22.0, 11), np.linspace(-5.0, 5.0, 13)
    away = np.hypot(x[:, None] - 17.4, z[None, :])
    latency = [None if r > 4.0 else 6.0 + 6.0 * r for r in away.ravel()]
    positions = [[place, across] for place in x.tolist() for across in z.tolist()]
    return {"recruitment": recruitment_section(positions, latency), "rates": rates_section()}


def recruitment_section(positions, early):
    late = [None if value is None else 1.5 * value for value in early]

    def rank(values):
        known = sorted(value for value in values if value is not None)
        return [None if value is None else 1.0 + known.index(value) for value in values]

    numbers = {"recruited_mm2": 22.5, "recruited_in_ramp_mm2": 16.8, "first_ms": 6.0, "median_ms": 20.0}
    return {
        "positions_mm": positions,
        "area_per_afferent_mm2": 0.75,
        "resting_latency_ms": None,
        "touches": [
            {"name": "287 /m", "both": 60, "either": 60, "rank_correlation": 1.0, "swapped": 0.0, **numbers},
            {"name": "365 /m", "both": 60, "either": 60, "rank_correlation": 0.987, "swapped": 0.031}
            | numbers,
        ],
        "afferents": [
            {"name": name, "first_spike_latency_ms": values, "recruitment_rank": rank(values)}
            for name, values in (("287 /m", early), ("365 /m", late))
        ],
    }


def rates_section():
    edges = np.concatenate([np.arange(0.0, 150.0, 10.0), np.arange(150.0, 1001.0, 50.0)])
    active_edges = np.arange(0.0, 1001.0, 50.0)
    rate = 60.0 + 140.0 * (edges[1:] <= 50.0)
    return {
        "edges_ms": edges.tolist(),
        "active_edges_ms": active_edges.tolist(),
        "smoothing_ms": 2.0,
        "density_per_cm2": 100.0,
        "resting_latency_ms": 251.0,
        "radii_mm": [0.0, 1.0, 2.0],
        "n_afferents": [50, 150],
        "touches": [
            {
                "name": name,
                "rate_hz": [rate.tolist(), (0.5 * rate).tolist()],
                "active_fraction": [[1.0] * (active_edges.size - 1), [0.5] * (active_edges.size - 1)],
                "together_per_cm2_hz": (factor * 60.0 * rate).tolist(),
            }
            for name, factor in (("287 /m", 1.0), ("365 /m", 1.1))
        ],
    }


def lines(axes):
    """Drawn lines by their labels."""
    return {line.get_label(): line for line in axes.get_lines()}


def test_captions_report_the_rate_without_a_touch():
    timing = typed(PopulationTiming, timing_section())
    assert "first fire at 251 ms. All start" in page.caption_population_rate(timing.rates)
    assert "Without touch" not in page.caption_recruitment(timing.recruitment)
    firing = replace(timing.recruitment, resting_latency_ms=251.0)
    assert "first fire at 251 ms. They count as recruited" in page.caption_recruitment(firing)


def test_the_figure_of_the_order_ranks_every_afferent_that_fires_and_counts_skin():
    section = typed(PopulationTiming, timing_section()).recruitment
    drawn = page.draw_recruitment(section).axes
    first, silent = section.afferents[0], drawn[0].collections[0]
    latency = np.array(first.first_spike_latency_ms, dtype=float)
    fires = np.isfinite(latency)
    assert len(silent.get_offsets()) == (~fires).sum() > 0
    ranks = np.array(first.recruitment_rank, dtype=float)[fires]
    np.testing.assert_array_equal(drawn[0].collections[1].get_array(), ranks)
    np.testing.assert_array_equal(
        drawn[0].collections[1].get_offsets(), np.array(section.positions_mm)[fires]
    )
    steps = lines(drawn[2])["365 /m"]
    np.testing.assert_array_equal(steps.get_xdata(), 1.5 * np.sort(latency[fires]))
    assert steps.get_ydata()[-1] == 0.75 * fires.sum()
    beside = lines(drawn[3])["365 /m"].get_xydata()
    np.testing.assert_array_equal(beside[fires], np.stack([latency[fires], 1.5 * latency[fires]], axis=1))


def test_the_figure_of_the_order_and_its_table_show_how_much_the_order_changes():
    section = typed(PopulationTiming, timing_section()).recruitment
    assert "365 /m: rank correlation 0.987, 3.1 % of the pairs in reversed order" in page.caption_recruitment(
        section
    )
    table = page.recruitment_tables(section)[0]
    assert list(table.rows[1].cells) == ["365 /m", "22.5", "16.8", "6.0", "20.0", "0.987", "3.1 %"]


def test_the_figure_of_the_order_of_one_touch_leaves_the_comparison_empty():
    section = typed(PopulationTiming, timing_section()).recruitment
    alone = replace(section, touches=section.touches[:1], afferents=section.afferents[:1])
    texts = [text.get_text() for axes in page.draw_recruitment(alone).axes for text in axes.texts]
    assert texts.count("no other touch") == 2
    assert "rank correlation" not in page.caption_recruitment(alone)


def test_the_figure_of_rates_has_one_scale_per_afferent_and_per_area():
    section = typed(PopulationTiming, timing_section()).rates
    figure = page.draw_population_rate(section)
    early = figure.axes[0]
    assert [patch.get_label() for patch in early.patches] == ["0 to 1 mm", "1 to 2 mm"]
    np.testing.assert_array_equal(early.patches[1].get_data().values, section.touches[0].rate_hz[1])
    beside = figure.axes[1].child_axes[0]
    figure.draw_without_rendering()
    # 100 per cm2 that fire 50 spikes/s each make 5000 spikes/s per cm2.
    assert beside.get_ylim()[1] / figure.axes[1].get_ylim()[1] == pytest.approx(5.0 / 50.0)
    assert "1000 spikes/s per cm²" in beside.get_ylabel()


def test_the_page_has_both_figures_and_the_table(tmp_path):
    manifest = Runner(tmp_path).manifest(Conditions("quick", seed=3))
    result = PopulationTimingStudy(timing=typed(PopulationTiming, timing_section()), manifest=manifest)
    text = write_markdown(page.population_timing_page(result), tmp_path / "page.md").read_text(
        encoding="utf-8"
    )
    assert "quick resolution, seed 3" in text
    assert "| 365 /m | 22.5 | 16.8 | 6.0 | 20.0 | 0.987 | 3.1 % |" in text
    for name in ("recruitment", "population_rate"):
        assert f"](images/{name}.png)" in text
        assert (tmp_path / "images" / f"{name}.png").is_file()
