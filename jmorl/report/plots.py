"""The plots of a run folder. Import it only to draw: it loads matplotlib."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from jmorl.report.families_plot import families_figure
from jmorl.report.front_plot import front_figure
from jmorl.report.parallel_coordinates import pairs_figure, parallel_figure
from jmorl.report.run_plots import prediction_figure, progress_figure
from jmorl.report.style import save, style
from jmorl.storage.stored_run import StoredRun


class PlotError(OSError):
    """Plots that could not be drawn. The message names each file, and what was wrong."""


def draw_run(run: StoredRun, folder: Path) -> list[Path]:
    """Draw a run into a folder, which is made if need be. Returns the paths of the PNG files.

    front.png: for two objectives every policy, the front of each generation, choices and bounds; for more the
    final front as parallel coordinates, and front_pairs.png with every pair of objectives. progress.png: the
    metrics over the steps. families.png: what lies between the policies of a front that was blended. prediction.png:
    predicted against realised changes; a run that ended with the warm-up has none. Raises PlotError if some of them
    cannot be drawn, when the others are.
    """
    config = run.config
    title = f"{config.env}, {config.method}, user {config.user}, seed {config.seed}"
    draws: dict[str, Callable[[StoredRun, str], Figure | None]]
    if len(run.objectives) == 2:
        draws = {"front.png": front_figure}
    else:
        draws = {"front.png": parallel_figure, "front_pairs.png": pairs_figure}
    draws |= {"families.png": families_figure, "prediction.png": prediction_figure, "progress.png": progress_figure}
    drawn, failed = [], []
    for name, draw in draws.items():
        try:
            with style():
                figure = draw(run, title)
                if figure:
                    folder.mkdir(parents=True, exist_ok=True)
                    drawn.append(save(figure, folder / name))
        except OSError as error:
            failed.append(f"{folder / name} cannot be written: {error.strerror or error}")
        except Exception as error:  # of a library: for such numbers or texts it was not made
            failed.append(f"{folder / name} cannot be drawn: {type(error).__name__}: {error}")
    if failed:
        raise PlotError("; ".join(failed))
    return drawn
