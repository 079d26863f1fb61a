"""The plots: what they show, and that they can be drawn of every kind of run."""

import io
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from envs.core import Objective
from jmorl.display.limits import inside
from jmorl.report.front_plot import choices_of, close_view, front_figure, whole_view
from jmorl.report.parallel_coordinates import parallel_figure
from jmorl.report.plots import PlotError, draw_run
from jmorl.report.run_plots import prediction_figure, progress_figure
from jmorl.report.style import RED, style
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import values_of

ALL = ["front.png", "prediction.png", "progress.png"]


def pixels(path):
    return imread(path)[..., :3]


def has_colour(image, colour):
    return (np.abs(image - np.array(to_rgb(colour))).max(axis=-1) < 0.02).sum() > 30


def texts(figure):
    """Everything that is written in a figure."""
    figure.draw_without_rendering()
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text) if text.get_visible() and text.get_text()]


@pytest.mark.parametrize(
    ("kinds", "names"),
    [
        ({}, ALL),
        ({"objectives": 3}, ["front.png", "front_pairs.png", "prediction.png", "progress.png"]),
        ({"interactive": False, "has_utility": False}, ALL),
        ({"generations": 0, "finished": False}, ["front.png", "progress.png"]),
    ],
)
def test_every_kind_of_run_can_be_drawn(make_run, tmp_path, kinds, names):
    before = dict(matplotlib.rcParams)
    run = make_run(**kinds)
    paths = draw_run(run, tmp_path / "deep" / "plots")
    assert paths == [tmp_path / "deep" / "plots" / name for name in names]
    assert sorted(path.name for path in paths[0].parent.iterdir()) == names
    for path in paths:
        image = pixels(path)
        height, width, _ = image.shape
        assert width > 900 and height > 600
        assert 0.01 < (image < 0.97).any(axis=-1).mean() < 0.9
        # Nothing is cut off at the edges.
        frame = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
        assert (frame == 1).all()
    assert has_colour(pixels(paths[0]), RED) == (run.chosen is not None)
    assert dict(matplotlib.rcParams) == before


def test_the_stairs_are_the_edge_of_what_the_front_dominates(make_run):
    run = make_run(outliers=0)
    with style():
        figure = front_figure(run, "title")
    axes = figure.axes[0]
    stairs = [line for line in axes.get_lines() if line.get_drawstyle() == "steps-pre"]
    assert len(stairs) == 11
    final, limits = stairs[-1], whole_view(run)
    front = values_of(run.front)
    x, y = final.get_data()
    for column in np.linspace(limits[0, 0], x[-1], 200)[1:-1]:
        # Steps are drawn before their point: at `column` the line has the height of the next point to the right.
        height = y[np.searchsorted(x, column)]
        best = front[front[:, 0] >= column, 1].max()
        assert height == best
    early = np.array(stairs[0].get_data()).T
    warmed_up = values_of([policy for policy in run.policies if policy.generation == 0])
    for point in warmed_up[non_dominated(warmed_up)]:
        assert (early == point).all(axis=1).any()


def test_hopeless_policies_do_not_squash_the_front(make_run):
    with_outliers, without = make_run(outliers=5), make_run(outliers=0)
    assert whole_view(with_outliers)[0, 0] > -400
    assert np.ptp(close_view(with_outliers), axis=0) == pytest.approx(np.ptp(close_view(without), axis=0), rel=0.01)
    with style():
        figure = front_figure(with_outliers, "title")
    noted = [text for text in texts(figure) if text.endswith("outside")]
    for note, axes in zip(noted, figure.axes[:2], strict=True):
        limits = np.array([axes.get_xlim(), axes.get_ylim()]).T
        outside = (~inside(values_of(with_outliers.policies), limits)).sum()
        assert note == f"{outside} of 66 policies outside"
    assert noted[0] == "5 of 66 policies outside"


def test_the_close_up_shows_the_chosen_policy_even_if_it_is_far_out(make_run):
    run = make_run()
    limits = close_view(run)
    assert inside(run.chosen.values, limits)
    policies = list(run.policies)
    policies[run.chosen.id] = replace(run.chosen, values=np.array([-700.0, -5.0]))
    far = replace(run, policies=tuple(policies))
    assert inside(far.chosen.values, close_view(far)) and not inside(far.chosen.values, limits)


def test_axes_have_quantity_and_unit(make_run):
    with style():
        for figure in (front_figure(make_run(), "title"), parallel_figure(make_run(objectives=3), "title")):
            assert {"time (-steps)", "fuel (-force²·steps)"} <= set(texts(figure))


def test_dollar_signs_are_no_formulae(make_run):
    run = make_run(generations=1)
    dear = replace(run, objectives=tuple(replace(each, unit="$^{-1}_$") for each in run.objectives))
    with style():
        figure = front_figure(dear, "title")
        figure.savefig(io.BytesIO(), format="png")
    assert "time ($^{-1}_$)" in texts(figure)


def test_choices_are_numbered_by_generation_and_drawn_together(make_run):
    run = make_run()
    numbered = {choice.generations for choice in choices_of(run)}
    assert "7–8" in numbered and "9" in numbered
    with style():
        assert numbered <= set(texts(front_figure(run, "title")))


def test_choices_of_a_stand_in_are_told_from_a_persons(make_run):
    """A choice that somebody made at least once is theirs."""
    run = make_run()
    answered = tuple(replace(each, stand_in=each.generation not in (1, 8)) for each in run.decisions)
    choices = {choice.generations: choice.asked for choice in choices_of(replace(run, decisions=answered))}
    assert choices["7–8"] and choices["1"] and not choices["9"]
    with style():
        told = texts(front_figure(replace(run, decisions=answered), "title"))
        before = texts(front_figure(run, "title"))
    assert {"choice, with its generation", "choice, with its generation, by the stand-in"} <= set(told)
    assert not any("stand-in" in text for text in before)


def test_a_confirmed_score_is_tied_to_the_score_that_the_search_went_by(make_run):
    run = make_run()
    claimed = run.chosen
    numbers = {"value": claimed.values - 1, "std": claimed.std, "error": np.ones(2)}
    numbers |= {"claimed": claimed.values, "claimed_std": claimed.std}
    row = {
        f"{name}_{each.name}": values[i] for name, values in numbers.items() for i, each in enumerate(run.objectives)
    }
    run = replace(run, result={"reason": "budget", "chosen": row | {"policy": claimed.id, "confirmation_episodes": 9}})
    with style():
        figure = front_figure(run, "title")
    ends = np.stack([claimed.values, claimed.values - 1])
    assert any(np.array_equal(line.get_xydata(), ends) for line in figure.axes[0].get_lines())
    assert f"chosen: policy {claimed.id}, confirmed score" in texts(figure)


def test_labels_of_choices_cover_neither_each_other_nor_policies(make_run):
    run = make_run()
    with style():
        figure = front_figure(run, "title")
        figure.savefig(io.BytesIO(), format="png")  # as it will be drawn
        for axes in figure.axes[:2]:
            labels = [text for text in axes.texts if text.get_bbox_patch() is not None]
            boxes = [label.get_bbox_patch().get_window_extent() for label in labels]
            assert labels
            shown = axes.transData.transform([choice.values for choice in choices_of(run)])
            front = axes.transData.transform(values_of(run.front))
            for index, box in enumerate(boxes):
                assert not any(box.overlaps(other) for other in boxes[:index])
                assert not box.count_contains(shown) and not box.count_contains(front)


def test_long_titles_and_legends_stay_within_the_picture(make_run):
    run = make_run()
    answered = tuple(replace(each, stand_in=each.generation > 2) for each in run.decisions)
    with style():
        figure = front_figure(replace(run, decisions=answered), "environment, method, user " + "1.2345," * 30)
        figure.savefig(io.BytesIO(), format="png")
        title = next(text for text in figure.texts if text.get_text().startswith("environment"))
        for artist in (figure.legends[0], title):
            box = artist.get_window_extent()
            assert box.x0 >= 0 and box.x1 <= figure.bbox.width


@pytest.mark.parametrize(("has_utility", "panels"), [(True, 3), (False, 2)])
def test_progress_has_utility_only_if_there_is_one(make_run, has_utility, panels):
    run = make_run(has_utility=has_utility)
    with style():
        figure = progress_figure(run, "title")
    assert len(figure.axes) == panels
    lines = figure.axes[0].get_lines()
    first = run.metrics["utility_max" if has_utility else "hypervolume"]
    assert np.array_equal(lines[0].get_ydata(), first) and np.array_equal(lines[0].get_xdata(), run.metrics["steps"])
    assert len(figure.axes[0].get_lines()) == (3 if has_utility else 1) + 10  # with a mark for each choice


def test_a_bad_start_does_not_hide_the_progress_after_it(make_run):
    run = make_run()
    hypervolume = np.array([-1e6, *np.linspace(100, 110, 10)])
    run = replace(run, metrics={**run.metrics, "hypervolume": hypervolume})
    with style():
        figure = progress_figure(run, "title")
    low, high = figure.axes[1].get_ylim()
    assert 90 < low < 100 and 110 < high < 120
    assert "1 point below" in texts(figure)


def test_predictions_are_compared_with_what_came_of_them(make_run):
    run = make_run()
    with style():
        figure = prediction_figure(run, "title")
        assert prediction_figure(make_run(generations=0), "title") is None
    offspring = [policy for policy in run.policies if policy.generation > 0]
    for index, axes in enumerate(figure.axes[:2]):
        lines, points = axes.collections
        assert len(lines.get_segments()) == sum(policy.interval is not None for policy in offspring) > 0
        expected = [
            (
                policy.predicted[index] - run.policies[policy.parent].values[index],
                policy.values[index] - run.policies[policy.parent].values[index],
            )
            for policy in offspring
        ]
        assert np.allclose(points.get_offsets(), expected)
        error = np.mean([abs(predicted - realised) for predicted, realised in expected])
        assert f"mean error {error:.3g};" in axes.get_title(loc="left")
        known = [policy for policy in offspring if policy.interval is not None]
        held = np.mean(
            [ends[0, index] <= policy.values[index] <= ends[1, index] for policy in known for ends in [policy.interval]]
        )
        assert f"{held:.0%} realised within the 80% interval" in axes.get_title(loc="left")
        assert axes.get_xlim() == axes.get_ylim()


def test_numbers_that_are_not_finite_are_left_out_and_counted(make_run, tmp_path):
    run = make_run()
    metrics = {**run.metrics, "hypervolume": np.full_like(run.metrics["hypervolume"], np.inf)}
    metrics["utility_mean"] = np.where(run.metrics["generation"] < 2, -np.inf, metrics["utility_mean"])
    run = replace(run, metrics=metrics)
    # The two means, and the first maximum, which is far from the others.
    notes = [text for text in texts(progress_figure(run, "")) if "point" in text]
    assert notes == ["3 points below", "11 points above"]
    assert [path.name for path in draw_run(run, tmp_path)] == ALL


@pytest.mark.parametrize("scale", [1e-200, 1e30, 1e200, 1e290])
def test_values_of_any_size_can_be_drawn(make_run, tmp_path, scale):
    run = make_run()
    policies = tuple(
        replace(each, values=scale * each.values, predicted=None if each.predicted is None else scale * each.predicted)
        for each in run.policies
    )
    run = replace(run, policies=policies, front=tuple(policies[each.id] for each in run.front))
    assert [path.name for path in draw_run(run, tmp_path)] == ALL


@pytest.mark.parametrize(
    "labels",
    [
        (("profit ($/h)", "US$"), ("cost_{x} ($)", "k$")),
        (("speed [km/h]", "km [sum]"), ("energy [/kWh]", "[-]")),
        (("Geschwindigkeit größer", "m/s²"), ("能耗 🚗", "千瓦")),
    ],
)
def test_labels_are_drawn_as_they_are(make_run, tmp_path, labels):
    """Without a warning about characters that the font lacks: warnings are errors here."""
    run = make_run()
    objectives = tuple(Objective(old.name, *new) for old, new in zip(run.objectives, labels, strict=True))
    run = replace(run, objectives=objectives)
    with style():
        written = texts(front_figure(run, ""))
    assert all(f"{label} ({unit})" in written for label, unit in labels)
    assert [path.name for path in draw_run(run, tmp_path)] == ALL


def test_a_plot_that_cannot_be_made_is_named_and_the_others_are_made(make_run, tmp_path, monkeypatch):
    def full(self, path, **options):
        if "prediction" in path.name:
            raise OSError(28, "No space left on device")
        return savefig(self, path, **options)

    def unforeseen(run, title):
        raise ZeroDivisionError("of a library")

    savefig = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", full)
    monkeypatch.setattr("jmorl.report.plots.front_figure", unforeseen)
    with pytest.raises(PlotError) as error:
        draw_run(make_run(), tmp_path)
    front, prediction = str(error.value).split("; ")
    assert front == f"{tmp_path / 'front.png'} cannot be drawn: ZeroDivisionError: of a library"
    assert prediction == f"{tmp_path / 'prediction.png'} cannot be written: No space left on device"
    assert [path.name for path in tmp_path.iterdir()] == ["progress.png"]
