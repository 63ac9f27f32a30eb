"""What scripts beside this one know of the folder of a run, without VTK or ParaView."""

import glob
import os
import xml.etree.ElementTree


def series(folder):
    """The .pvd files of a run. @returns {end: path}; the end is that of a file's name behind the run's: "" for its surfaces,
    "_springs", "_bodies", "_failed". Without a run in the folder, or with several, there are none"""
    paths = sorted(glob.glob(os.path.join(glob.escape(folder), "*.pvd")), key=len)
    stems = [path[:-len(".pvd")] for path in paths]
    if any(not stem.startswith(stems[0] + "_") for stem in stems[1:]):
        return {}
    return {stem[len(stems[0]):]: path for stem, path in zip(stems, paths)}


def fault_of_frame(path):
    """In words, what is wrong with the files of a frame, a .pvtp and the pieces that it names; "" if they are whole.
    VTK's readers take a piece that is not there, or is cut, for an empty one."""
    try:
        pieces = [os.path.join(os.path.dirname(path), piece.get("Source") or "")
                  for piece in xml.etree.ElementTree.parse(path).iter("Piece")]
    except (OSError, xml.etree.ElementTree.ParseError) as error:
        return f"{path}: {getattr(error, 'strerror', None) or error}; expected a frame of the run"
    for piece in pieces:
        try:
            with open(piece, "rb") as file:
                file.seek(max(0, file.seek(0, os.SEEK_END) - 100))
                is_whole = file.read().rstrip().endswith(b"</VTKFile>")
        except OSError as error:
            return f"{piece}: {error.strerror}; expected a piece of a frame, which {os.path.basename(path)} names"
        if not is_whole:
            return f"{piece}: cut before its end; expected a whole piece of a frame"
    return ""


def evenly(count, wanted):
    """`wanted` of the numbers 0 to count - 1, evenly spread, the first and the last among them."""
    wanted = max(1, min(count, wanted))
    return sorted({round(i * (count - 1) / max(1, wanted - 1)) for i in range(wanted)})


def histories(folder):
    """The tables of a run with a row a step. @returns {object: path}, the object "" where a run has one without a name;
    tables that have no row yet are left out"""
    found = {}
    for path in sorted(glob.glob(os.path.join(glob.escape(folder), "history*.csv"))):
        with open(path, encoding="utf-8") as file:
            if len(file.readlines(2**16)) > 1:
                found[os.path.basename(path)[len("history"):-len(".csv")].lstrip("_")] = path
    return found
