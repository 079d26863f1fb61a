"""The plots of a run folder. Import it only to draw: it loads matplotlib."""

from pathlib import Path

from jmorl.report.front_plot import front_figure
from jmorl.report.parallel_coordinates import pairs_figure, parallel_figure
from jmorl.report.run_plots import prediction_figure, progress_figure
from jmorl.report.style import save, style
from jmorl.storage.stored_run import StoredRun


def draw_run(run: StoredRun, folder: Path) -> list[Path]:
    """Draw a run into a folder, which is made if need be. Returns the paths of the PNG files.

    front.png: for two objectives every policy, the front of each generation, choices and bounds; for more the
    final front as parallel coordinates, and front_pairs.png with every pair of objectives. progress.png: the
    metrics over the steps. prediction.png: predicted against realised changes; a run that ended with the warm-up
    has none.
    """
    config = run.config
    title = f"{config.env}, {config.method}, user {config.user}, seed {config.seed}"
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        figures = {"progress.png": progress_figure(run, title), "prediction.png": prediction_figure(run, title)}
        if len(run.objectives) == 2:
            figures["front.png"] = front_figure(run, title)
        else:
            figures |= {"front.png": parallel_figure(run, title), "front_pairs.png": pairs_figure(run, title)}
        return [save(figure, folder / name) for name, figure in sorted(figures.items()) if figure is not None]
