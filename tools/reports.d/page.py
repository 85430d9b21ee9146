"""Stores an error report compactly, and makes docs/error-reports.md from the stored ones.

    page.py store ERROR.JSON STORED.JSON COMMAND     four digits of each number, the command beside it
    page.py page FOLDER PAGE                         the page of all stored reports
"""

import json
import pathlib
import sys

HEAD = """# Error reports

<!-- Generated: `tools/reports` measures docs/reports and writes this page from it. Do not edit it. -->

These are results of `echolume report error`: errors of a picture against a reference, and what it takes to compute. "RMSE" is the error before the tone mapping
of stage 4 (values in 0..1). The other errors are differences after it, in levels of 255: their median, their 95th percentile (p95), and the shares of the pixels that
differ by more than 1 and by more than 8 levels. Each table after the error budget varies one setting, which the heading names with its unit.

Times are medians with intervals of 95 %: to make the volume, and to draw the picture. "Of the scene's time" is the sum of both over that of the unchanged scene, which
ran in turn with the setting; the row of the scene itself differs from 1 by noise. In the error budget each approximation includes the device's own arithmetic, which its last but one row has alone.

How the reports are made: [measuring.md](measuring.md#error-against-run-time). What the references are: [numerics.md](numerics.md#the-exact-reference-of-a-ray).
"""


def short(value):
    """The value with four digits, in the whole structure."""
    if isinstance(value, float):
        return float(f"{value:.4g}")
    if isinstance(value, list):
        return [short(v) for v in value]
    if isinstance(value, dict):
        return {k: short(v) for k, v in value.items()}
    return value


def store(source, target, command):
    report = short(json.loads(pathlib.Path(source).read_text()))
    path = pathlib.Path(target)
    path.write_text(json.dumps(report, separators=(",", ":")) + "\n")
    path.with_suffix(".command").write_text(command + "\n")


def percent(share):
    return f"{100 * share:.2f} %"


def errors(e):
    l = e["levels"]
    return f"{e['rmse']:.1e} | {l['median']:.2f} | {l['p95']:.2f} | {percent(l['over_1'])} | {percent(l['over_8'])}"


COLUMNS = "RMSE | median | p95 | over 1 level | over 8"


def milliseconds(t):
    return f"{t['median'] / 1e6:.1f} ({t['low'] / 1e6:.1f} to {t['high'] / 1e6:.1f})"


def reference(r):
    if r["kind"] == "exact":
        return f"exact rays, integrated in {r['pieces']} pieces, with an estimated error of {r['estimate']:.0e} of their own"
    if r["kind"] == "f64":
        return "the f64 reference"
    if r["kind"] == "as-it-is":
        return "the scene as it is"
    if r["kind"] == "extrapolated":
        cells = " to ".join(f"{r['cells'][n]:.2f}" for n in (0, 2))
        return f"pictures with light cells of {cells} mm, extrapolated to cells of no size with order {r['order']:.1f}; the error of this reference is {r['rmse']:.1e} (RMSE)"
    return f"a converged picture, whose own error is {r['rmse']:.1e} (RMSE)"


def table(head, rows):
    lines = ["| " + head + " |", "|" + "---|" * (head.count("|") + 1)]
    return "\n".join(lines + ["| " + row + " |" for row in rows]) + "\n"


def dial(d):
    rows = []
    for p in sorted(d["points"], key=lambda p: -p["value"]) if d["is_ordered"] else d["points"]:
        mark = " (the scene)" if p["is_default"] else ""
        times = p["times"]
        ratio = p["ratios"]["total"]
        rows.append(f"{p['label']}{mark} | {errors(p['errors'])} | {milliseconds(times['volume'])} | {milliseconds(times['picture'])} | {ratio['median']:.2f}")
    unit = f", {d['unit']}" if d["unit"] else ""
    order = f" The error falls with order {d['order']['order']:.2f} +- {d['order']['standard_error']:.2f} of the setting." if d.get("order") else ""
    text = f"\n### {d['name']}{unit}\n\nAgainst {reference(d['reference'])}.{order}\n\n"
    return text + table(f"setting | {COLUMNS} | volume, ms | picture, ms | of the scene's time", rows)


def page(folder, target):
    text = HEAD
    for path in sorted(pathlib.Path(folder).glob("*.json")):
        r = json.loads(path.read_text())
        command = path.with_suffix(".command").read_text().strip()
        w, h, d = r["sizes"]["volume"]
        pw, ph = r["sizes"]["picture"]
        text += f"\n## {path.stem}\n\n```sh\n{command}\n```\n\n"
        text += f"{r['device']}, {r['driver']}, {r['date'][:10]}; volume {w} x {h} x {d}, picture {pw} x {ph}, {r['repeats']} runs of each setting.\n\n"
        budget = r["budget"]
        text += "### Error budget\n\n"
        text += f"Each row has one approximation as in the scene, and all others as fine as they get. Against {reference(budget['reference'])}.\n\n"
        rows = [f"{s['source']}: {s['label']} | {errors(s['errors'])}" for s in budget["shares"]]
        rows.append(f"**together: the scene as it is** | {errors(budget['total'])}")
        text += table(f"approximation | {COLUMNS}", rows)
        for d in r["dials"]:
            if d["kind"] in ("numerical", "several") and d["name"] in ("step", "format", "light-cell", "pipeline", "compositing", "termination", "tolerance"):
                text += dial(d)
    pathlib.Path(target).write_text(text)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["store", source, target, command]:
            store(source, target, command)
        case ["page", folder, target]:
            page(folder, target)
        case _:
            sys.exit(__doc__)
