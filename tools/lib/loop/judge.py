# SPDX-License-Identifier: Apache-2.0
"""How far the twin is from the camera at places that were not used, before and after, and by noise alone."""
import concurrent.futures
import math
import pathlib

import frames

# Runs and cameras of them: the camera twice, for the noise, and the twin as it was and as it is now.
RECORDINGS = {"camera": ("before", "a"), "twin": ("before", "b"), "again": ("after", "a"), "corrected": ("after", "b")}


def images_of(toftwin, out, name):
    """Mean range of each camera at one place, and which pixels lie away from edges."""
    index = {run: frames.captures_of(out / run)[name] for run in ("before", "after")}
    path = {who: out / run / index[run][side]["file"] for who, (run, side) in RECORDINGS.items()}
    with concurrent.futures.ThreadPoolExecutor() as pool:
        ranges = dict(zip(path, pool.map(lambda p: frames.mean_image(toftwin, p, "range"), path.values())))
    # Where the edges are says the scene: on dark things noise would look like edges.
    width, height, truth = frames.mean_image(toftwin, path["twin"], "truth_range")
    judged = frames.away_from_edges(width, height, truth)
    return {"name": name, "width": width, "height": height, "camera": path["camera"],
            "range": {who: image for who, (_, _, image) in ranges.items()}, "judged": judged}


def judged_place(place):
    """Errors of one place as images in millimetres: twin − camera before and after, camera − camera for the noise."""
    seen = place["range"]
    # The same pixels for all three, or one of them could look better by leaving out what is hard.
    judged = [good and not any(map(math.isnan, values)) for good, *values in zip(place["judged"], *seen.values())]
    place["before"] = frames.difference_mm(seen["camera"], seen["twin"], judged)
    place["after"] = frames.difference_mm(seen["camera"], seen["corrected"], judged)
    place["noise"] = frames.difference_mm(seen["camera"], seen["again"], judged)
    place["pixels"] = sum(judged)
    return place


def judge(toftwin, out):
    """(places with their images, RMS in millimetres over all their pixels: before, after and noise)."""
    out = pathlib.Path(out)
    names = list(frames.captures_of(out / "before"))
    places = [judged_place(images_of(toftwin, out, name)) for name in names]
    over_all = {what: frames.rms([value for place in places for value in place[what]])
                for what in ("before", "after", "noise")}
    return places, over_all
