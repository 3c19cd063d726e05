# SPDX-License-Identifier: Apache-2.0
"""page.py --toftwin PROGRAM --files FOLDER --out OUT: judges the loop of tools/lib/loop/run at the places that were not
used, and writes OUT/index.html and OUT/loop.json."""
import argparse
import datetime
import html
import json
import math
import pathlib
import string
import tomllib

import frames
import judge
import pictures
import words


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--toftwin", required=True)
    parser.add_argument("--files", required=True, type=pathlib.Path)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--tab", action="append", default=[], help="TITLE=PAGE")
    parser.add_argument("--note", default="")
    return parser.parse_args()


def read_toml(path):
    with open(path, "rb") as file:
        return tomllib.load(file)


def write_whole(path, text):
    """Writes a file beside its place and moves it there, so that nobody finds half of it."""
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)


def hidden_effects(files, out):
    """Effects that the sealed file has and the twin does not."""
    declared = read_toml(files / "twin.toml")["effect"]
    return [effect for effect in read_toml(out / "opened.toml")["effect"] if effect not in declared]


def shown_place(places):
    """The place that is shown: the middle one by its error before, neither the best nor the worst."""
    return sorted(places, key=lambda place: frames.rms(place["before"]))[len(places) // 2]


def full_scale(place):
    """End of the colour scale in millimetres: a round number that a twentieth of the errors before exceeds."""
    sizes = sorted(abs(value) for value in place["before"] if not math.isnan(value))
    wanted = sizes[int(0.95 * (len(sizes) - 1))] if sizes else 1.0
    return next((step for step in (1, 2, 5, 10, 20, 50, 100, 200, 500) if step >= wanted), 1000)


def picture_row(toftwin, place, full):
    width, height = place["width"], place["height"]
    _, _, amplitude = frames.mean_image(toftwin, place["camera"], "amplitude")
    error = {what: pictures.errors(width, height, place[what], full) for what in ("before", "after", "noise")}
    caption = {"before": "Error before", "after": "Error after", "noise": "Noise alone"}
    shown = [(pictures.brightness(width, height, amplitude), "What the camera sees", html.escape(place["name"].split(": ", 1)[-1]))]
    shown += [(error[what], caption[what], f"<b>{frames.rms(place[what]):.1f} mm</b>") for what in caption]
    return "\n".join(f'<figure><img src="{source}" alt="{words}"><figcaption>{words}: {value}</figcaption></figure>'
                     for source, words, value in shown)


def place_rows(places):
    return "\n".join(
        f'<tr><td>{html.escape(place["name"])}</td><td class="n">{place["pixels"]}</td>'
        + "".join(f'<td class="n">{frames.rms(place[what]):.2f}</td>' for what in ("before", "after", "noise")) + "</tr>"
        for place in places)


def summary(places, rms, hidden, report, hash_):
    """What loop.json says."""
    return {"rms_before_mm": rms["before"], "rms_after_mm": rms["after"], "rms_noise_mm": rms["noise"],
            "places": [{"name": p["name"], "pixels": p["pixels"], "rms_before_mm": frames.rms(p["before"]),
                        "rms_after_mm": frames.rms(p["after"]), "rms_noise_mm": frames.rms(p["noise"])} for p in places],
            "hidden": hidden, "found": [effect["name"] for effect in words.causes(report)],
            "verdict": report["verdict"], "sealed_sha256": hash_}


def main():
    options = arguments()
    out = options.out
    report = json.loads((out / "found" / "report.json").read_text(encoding="utf-8"))
    hidden = hidden_effects(options.files, out)
    choices = {one["type"]: one for one in read_toml(options.files / "hidden.toml")["imperfection"]}
    hash_ = (out / "sealed.sha256").read_text(encoding="utf-8").strip()
    places, rms = judge.judge(options.toftwin, out)
    place = shown_place(places)
    full = full_scale(place)
    opened = datetime.datetime.fromtimestamp((out / "opened.toml").stat().st_mtime, datetime.timezone.utc)
    tabs = "".join(f'<a href="{html.escape(page)}">{html.escape(title)}</a>'
                   for title, page in (tab.split("=", 1) for tab in ["The search=found/index.html", *options.tab]))
    template = string.Template((pathlib.Path(__file__).parent / "page.html").read_text(encoding="utf-8"))
    page = template.substitute(
        title=words.title(rms), tabs=tabs, hidden=words.hidden_list(hidden, choices),
        found=words.found_list(report, hidden, choices), hash=hash_, opened=f"{opened:%H:%M:%S} UTC",
        captures=report["captures"], places=len(places), pixels=sum(one["pixels"] for one in places),
        bars=words.bars(rms), shape=f"{place['width']}/{place['height']}",
        pictures=picture_row(options.toftwin, place, full), full=full,
        numbers=words.number_rows(report, hidden), rows=place_rows(places),
        foot=html.escape(f"{report['software']}, {report['date']}. {options.note}"))
    write_whole(out / "loop.json", json.dumps(summary(places, rms, hidden, report, hash_), indent=1))
    write_whole(out / "index.html", page)
    print(words.in_a_line(rms, hidden, report))
    print(f"{out / 'index.html'}: open it in a browser")


if __name__ == "__main__":
    main()
