#!/usr/bin/python3
"""Plots the histories of runs, several in one figure: postproc/plots.py OUT [OUT ...]

  postproc/plots.py output/burning_paper                      # output/burning_paper/plots.png and plots.svg
  postproc/plots.py output/coarse output/fine --to compared --panels heat,strain_rms,seconds

OUT is the folder of a run: its history.csv, or history_NAME.csv of each object, and projection.csv where it is. A panel is
drawn where one of the runs has something to show in it. Colours are quantities, line styles are runs. Panels:

  mass              mass left and burnt, and their sum
  heat              heat content, heat that came in, went out and was made, and what is missing in the sum of these
  temperature       highest of the surface, and of the gas
  strain_max        largest strain of the springs, by colour of the paper
  strain_rms        root mean square of it
  constraint_error  norm of the constraints of a projected sheet, of all and by colour (with -project_monitor)
  pressure_volume   pressure of the gas against its volume
  pressure_stretch  pressure of the gas against the cube root of its volume over that at first
  gas               amount of gas in the chambers, and what has gone through links and walls
  thickness         least and largest thickness of a balloon's wall
  energy            kinetic and elastic energy
  iterations        of heat, of the step's linear systems, of Newton's method, in each step
  residual          what a step's forces are out of balance by, relative to them
  time_step         length of the steps
  seconds           seconds that each stage took, all steps together
"""

import argparse
import csv
import itertools
import math
import os
import re
import sys

import run_folder


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT")
    parser.add_argument("--to", metavar="STEM", help="of the files STEM.png and STEM.svg (OUT/plots, of the first OUT)")
    parser.add_argument("--panels", metavar="NAME,...", help="which of the panels (all that have something to show)")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    options.panels = options.panels.split(",") if options.panels else list(PANELS)
    for name in options.panels:
        if name not in PANELS:
            parser.error(f"--panels {name}: no such panel; expected some of {', '.join(PANELS)}")
    options.histories = {}
    for folder in options.folders:
        found = run_folder.histories(folder)
        if not found:
            parser.error(f"{folder}: no history.csv with a row; expected the folder of a run")
        for name, path in found.items():
            run = os.path.basename(os.path.abspath(folder))
            if [os.path.basename(os.path.abspath(other)) for other in options.folders].count(run) > 1:
                run = folder
            options.histories[f"{run}: {name}" if name else run] = path
    options.to = options.to or os.path.join(options.folders[0], "plots")
    if not os.path.isdir(os.path.dirname(options.to) or "."):
        parser.error(f"--to {options.to}: no such folder {os.path.dirname(options.to)}")
    return options


class History:
    """The columns of a table of a run. @param rows "all", or "last of a step" """

    def __init__(self, run, path, rows="all"):
        self.run = run
        with open(path, encoding="utf-8") as file:
            head, *lines = csv.reader(file)
        values = numpy.array([[float(value) for value in line] for line in lines])
        columns = [name.split(" [")[0] for name in head]
        if rows == "last of a step":
            step = values[:, columns.index("step")]
            values = values[numpy.append(step[1:] != step[:-1], True)]
        self.columns = dict(zip(columns, values.T))

    def __getitem__(self, name):
        return self.columns[name]

    def matching(self, pattern):
        return [name for name in self.columns if re.fullmatch(pattern, name)]


def words(name):
    return name.replace("_", " ")


def draw_line(history, axes, name, x, y, style, colour):
    axes.plot(x, y, style, color=colour, label=words(name), linewidth=1.2, gid=f"{history.run}: {axes.get_title()}: {name}")


def over_time(pattern, axis_label, log=False, colours=(), more=None):
    """A panel of the columns whose names match, over time.
    @param colours {end of a name: colour} @param more function of a history that returns further {name: values}"""
    def draw(history, axes, style, colour_of):
        lines = {name: history[name] for name in history.matching(pattern)}
        lines.update(more(history) if more else {})
        for name, values in lines.items():
            if log or name == "time_step":  # the first row has none
                values = numpy.where(values > 0, values, numpy.nan)
            if not numpy.nan_to_num(values).any():
                continue
            colour = next((colour for end, colour in dict(colours).items() if name.endswith(end)), None) or colour_of(name)
            draw_line(history, axes, name, history["time"], values, style, colour)
        axes.set(xlabel="time [s]", ylabel=axis_label, yscale="log" if log else "linear")
    return draw


def mass_sum(history):
    return {"sum": history["mass_left"] + history["mass_burnt"]} if history.matching("mass_burnt") else {}


def heat_missing(history):
    if not history.matching("heat_content"):
        return {}
    content = history["heat_content"]
    missing = content - content[0] - history["heat_in"] + history["heat_out"] - history["heat_made"]
    return {f"missing, at most {abs(missing).max():.1e} J": missing}


def pressure(against):
    def draw(history, axes, style, colour_of):
        for name in history.matching("gas_pressure(_.*)?"):
            chamber = name[len("gas_pressure"):]
            volume = history["gas_volume" + chamber] if "gas_volume" + chamber in history.columns else None
            if volume is None or not (volume > 0).all() or (chamber == "" and len(history.matching("gas_pressure_.*")) > 1):
                continue
            across = volume if against == "volume" else numpy.cbrt(volume / volume[0])
            draw_line(history, axes, name, across, history[name], style, colour_of(name))
        axes.set(xlabel="volume [m$^3$]" if against == "volume" else "cube root of volume over that at first",
                 ylabel="pressure against outside [Pa]")
    return draw


def seconds(histories, axes):
    stages = list(dict.fromkeys(name for history in histories.values() for name in history.matching("seconds_.*")
                                if history[name].sum() > 0))[::-1]
    height = 0.8 / len(histories)
    for number, (run, history) in enumerate(histories.items()):
        sums = [history[name].sum() if name in history.columns else 0 for name in stages]
        axes.barh([place + 0.4 - (number + 0.5) * height for place in range(len(stages))], sums, height,
                  color=f"C{number}", label=run)
    axes.set_yticks(range(len(stages)), [words(name[len("seconds_"):]) for name in stages])
    axes.set(xlabel="time in all steps [s]")


SPRINGS = {"_red": "tab:red", "_green": "tab:green", "_blue": "tab:blue", "_yellow": "goldenrod", "_total": "k",
           "constraint_error": "k"}
PANELS = {
    "mass": over_time("mass_left|mass_burnt", "mass [kg]", more=mass_sum),
    "heat": over_time("heat_(content|in|out|made)", "heat [J]", more=heat_missing),
    "temperature": over_time("temperature_max|gas_temperature(_.*)?", "temperature [K]"),
    "strain_max": over_time("strain_max_.*", "largest strain", colours=SPRINGS),
    "strain_rms": over_time("strain_rms_.*", "root mean square strain", colours=SPRINGS),
    "constraint_error": over_time("constraint_error|error_.*", "norm of the constraints [m]", log=True, colours=SPRINGS),
    "pressure_volume": pressure("volume"),
    "pressure_stretch": pressure("stretch"),
    "gas": over_time("gas_amount(_.*)?|through_.*|gas_leak", "amount [mol]"),
    "thickness": over_time("thickness_(min|max)", "thickness [m]"),
    "energy": over_time("kinetic_energy|elastic_energy", "energy [J]"),
    "iterations": over_time("(heat|projection|newton|linear)_iterations", "iterations in a step"),
    "residual": over_time("force_residual|relative_residual", "residual over forces", log=True),
    "time_step": over_time("time_step", "length of the step [s]"),
    "seconds": seconds,
}
OPTIONS = arguments()

# After the arguments, since they take a while.
import matplotlib  # noqa: E402
import numpy  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

STYLES = ["-", "--", ":", "-."]


def line(style, colour="k"):
    return pyplot.Line2D([], [], color=colour, linestyle=style)


def draw_panel(name, tables, axes):
    """@param tables of each run @returns whether there is something in it"""
    axes.set_title(words(name), fontsize=10)
    axes.grid(alpha=0.3)
    if name == "seconds":
        seconds({run: of_run[0] for run, of_run in tables.items()}, axes)
        if len(tables) > 1:
            axes.legend(fontsize=7)
        return bool(axes.patches)
    colours = {}
    for style, (history, projections) in zip(itertools.cycle(STYLES), tables.values()):
        for table in (history, projections) if name == "constraint_error" and projections else (history,):
            PANELS[name](table, axes, style, lambda quantity: colours.setdefault(quantity, f"C{len(colours)}"))
    labels = {drawn.get_label(): line("-", drawn.get_color()) for drawn in axes.lines}
    axes.legend(labels.values(), labels.keys(), fontsize=7)
    axes.ticklabel_format(axis="x", useOffset=False)
    if axes.get_yscale() == "linear":
        axes.ticklabel_format(axis="y", scilimits=(-3, 4), useOffset=False)
    return bool(labels)


def main():
    tables = {}
    for run, path in OPTIONS.histories.items():
        folder, name = os.path.split(path)
        projections = os.path.join(folder, name.replace("history", "projection"))
        of_projections = History(run, projections, "last of a step") if os.path.isfile(projections) else None
        tables[run] = History(run, path), of_projections
    pyplot.rcParams["font.size"] = 8
    pyplot.rcParams["svg.fonttype"] = "none"  # text that can be edited and found
    figure = pyplot.figure()
    panels = []
    for name in OPTIONS.panels:
        axes = figure.add_subplot()
        if draw_panel(name, tables, axes):
            panels.append(axes)
        else:
            axes.remove()
    if not panels:
        sys.exit(f"plots.py: nothing to show of {', '.join(OPTIONS.panels)} in {', '.join(OPTIONS.folders)}")
    columns = min(3, len(panels))
    rows = math.ceil(len(panels) / columns)
    for axes, place in zip(panels, figure.add_gridspec(rows, columns)):
        axes.set_subplotspec(place)
    figure.set_size_inches(4.2 * columns, 3.1 * rows + 0.4)
    if len(tables) > 1:
        figure.legend([line(style) for style, _ in zip(itertools.cycle(STYLES), tables)], tables.keys(), loc="upper center",
                      ncol=3)
    else:
        figure.suptitle(next(iter(tables)), fontsize=11)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.3 / figure.get_figheight()))
    for end in ("png", "svg"):
        path = f"{OPTIONS.to}.{end}"
        try:
            figure.savefig(path, dpi=110)
        except OSError as error:
            sys.exit(f"plots.py: {path}: {error.strerror}")
        print(path)


main()
