"""What was measured as a table, and pictures side by side."""

import json
import os


def median(values):
    values = sorted(values)
    n = len(values)
    return (values[n // 2] + values[(n - 1) // 2]) / 2


def summary(values):
    """Median and the range of the middle half, ms."""
    values = sorted(v * 1e-6 for v in values)
    n = len(values)
    return median(values), values[n // 4], values[n - 1 - n // 4]


def ratio(measured, kind):
    """Echolume over the fastest peer, and which that is; None where one of them is missing."""
    cells = measured["cells"]
    own = cells.get("Echolume", {})
    peers = {name: median(c[kind]) for name, c in cells.items() if name != "Echolume" and c.get(kind)}
    if not own.get(kind) or not peers:
        return None
    fastest = min(peers, key=peers.get)
    return median(own[kind]) / peers[fastest], fastest


def judged(measured):
    found, aim = ratio(measured, measured.get("judged_by", "cpu")), measured["aim"]
    if found is None or aim is None:
        return ""
    return f"{'reached' if found[0] <= aim else 'missed'} ({aim:g})"


def number(value):
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def line(measured):
    """One line for the terminal."""
    text = f"{measured['title']}, {measured['size']}"
    for kind in ("wall", "cpu"):
        found = ratio(measured, kind)
        text += f": {kind} " if kind == "wall" else ", CPU "
        text += f"{found[0]:.3f} of {found[1]}" if found else "no ratio"
    aim = judged(measured)
    text += f"; aim {aim}" if aim else ""
    faults = [f"{name}: {c['fault']}" for name, c in measured["cells"].items() if "fault" in c]
    return text + "".join(f"\n    {fault}" for fault in faults)


def cell(contestant):
    if "fault" in contestant:
        return contestant["fault"].replace("|", "/")
    parts = []
    for kind in ("wall", "cpu"):
        if contestant.get(kind):
            middle, low, high = summary(contestant[kind])
            parts.append(f"{number(middle)} ({number(low)}..{number(high)})")
    return " / ".join(parts) or "nothing measured"


def write(folder, order, machine):
    """table.md and table.json from every row that the folder holds."""
    measured = []
    for name in os.listdir(os.path.join(folder, "rows")):
        if name.endswith(".json"):
            with open(os.path.join(folder, "rows", name)) as file:
                measured.append(json.load(file))
    place = {key: i for i, key in enumerate(order)}
    measured.sort(key=lambda m: (place.get(m["row"], len(place)), m["size"]))
    versions = sorted({c["version"] for m in measured for c in m["cells"].values() if c.get("version")})
    drivers = sorted({c["driver"] for m in measured for c in m["cells"].values() if c.get("driver")})
    dates = sorted(m["date"] for m in measured)
    head = {"format": "echolume-peers-1", "machine": machine, "versions": versions, "drivers": drivers, "rows": measured}
    with open(os.path.join(folder, "table.json"), "w") as file:
        json.dump(head, file, indent=1)
    judged_by = "by the wall" if any(m.get("judged_by") == "wall" for m in measured) else "of the CPU"
    marks, lines = [], []
    for m in measured:
        peers = []
        for name, contestant in m["cells"].items():
            if name == "Echolume":
                continue
            mark = ""
            if contestant.get("note"):
                if contestant["note"] not in marks:
                    marks.append(contestant["note"])
                mark = f" [{marks.index(contestant['note']) + 1}]"
            differs = contestant.get("differs")
            said = f"; differs by {differs:.1f}" if differs is not None and not mark else ""
            peers.append(f"{name}{mark}: {cell(contestant)}{said}")
        found = [ratio(m, kind) for kind in ("wall", "cpu")]
        shown = [f"{f[0]:.2f} ({f[1]})" if f else "" for f in found]
        own = cell(m["cells"]["Echolume"])
        lines.append(f"| {m['title']} | {m['size']} | {own} | {'<br>'.join(peers)} | {shown[0]} | {shown[1]} | {judged(m)} |")
    with open(os.path.join(folder, "table.md"), "w") as file:
        file.write(
            f"{machine['cpu']}, {machine['cores']} cores; {'; '.join(versions)}; {'; '.join(drivers)}; "
            f"{dates[0] if dates else ''} to {dates[-1] if dates else ''}. ms, wall / CPU (user and system, all threads): median "
            f"(middle half). Ratios: Echolume over the fastest peer; the aim is of the time {judged_by}. \"Differs\": mean difference between "
            "the peer's first picture and Echolume's, grey levels of 255.\n\n"
            "| work | size | Echolume | peers | wall ratio | CPU ratio | aim |\n|---|---|---|---|---|---|---|\n"
        )
        file.write("\n".join(lines) + "\n")
        if marks:
            file.write("\nAnother method: " + "; ".join(f"[{i + 1}] {m}" for i, m in enumerate(marks)) + ".\n")


def side_by_side(pictures, folder, row, size):
    """All contestants' pictures of a row in one PNG, in the order of the table. Gives each peer's mean difference from
    Echolume's picture, in grey levels of 255, where both have the same size."""
    import numpy as np
    from PIL import Image

    if not pictures:
        return {}
    opened = {name: Image.open(file).convert("RGB") for name, file in pictures}
    wide = Image.new("RGB", (sum(p.width for p in opened.values()), max(p.height for p in opened.values())))
    at = 0
    for picture in opened.values():
        wide.paste(picture, (at, 0))
        at += picture.width
    names = "-".join(name.replace(" ", "") for name in opened)
    wide.save(os.path.join(folder, f"{row.name}{'-new' if row.new else ''}-{size}.png"), pnginfo=_text("contestants", names))
    for _, file in pictures:
        os.remove(file)
    arrays = {name: np.asarray(picture, np.float64) for name, picture in opened.items()}
    own = arrays.pop("Echolume", None)
    return {name: float(np.abs(a - own).mean()) for name, a in arrays.items() if own is not None and a.shape == own.shape}


def _text(key, value):
    from PIL.PngImagePlugin import PngInfo

    text = PngInfo()
    text.add_text(key, value)
    return text
