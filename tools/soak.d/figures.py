"""What a soak found: growth, drift and accounts, and whether it passed."""
import statistics

# Seconds that belong to one value of a slope.
WINDOW = 60


def slope(points):
    """The slope of the line of least squares through (hours, value); 0 of less than two points."""
    if len(points) < 2:
        return 0.0
    x, y = [p[0] for p in points], [p[1] for p in points]
    middle, mean = statistics.fmean(x), statistics.fmean(y)
    spread = sum((v - middle) ** 2 for v in x)
    return sum((a - middle) * (b - mean) for a, b in zip(x, y)) / spread if spread else 0.0


def parts(points, seconds):
    """The points of the first and of the last hour; of a run below three hours, those of its first and last third."""
    part = min(3600, seconds / 3)
    return [p for p in points if p[0] <= part], [p for p in points if p[0] >= seconds - part]


def of_series(points, seconds):
    """Of (seconds, value): medians and slopes an hour of the first and the last part, slope of all after the first part, and growth: the
    median of the last part less that of the middle third, so that what is taken once at the start is not growth."""
    first, last = parts(points, seconds)
    hourly = lambda chosen: slope([(at / 3600, value) for at, value in chosen])
    median = lambda chosen: statistics.median([value for _, value in chosen]) if chosen else 0.0
    middle = [p for p in points if seconds / 3 < p[0] <= 2 * seconds / 3]
    return {"first": median(first), "middle": median(middle), "last": median(last), "least": min((v for _, v in points), default=0.0),
            "greatest": max((v for _, v in points), default=0.0), "first_slope": hourly(first), "last_slope": hourly(last),
            "slope": hourly([p for p in points if p[0] > seconds / 3]), "growth": median(last) - median(middle)}


def accounts(sent, slices, totals, counts):
    """Sentences about frames and volumes that are in no count; none if every one is. `sent`: volumes that left the sender, "whole" and "damaged".

    A volume is `slices` frames. Every volume that was sent is passed over as damaged, or dropped as overtaken, or its frames arrive; a frame
    that arrives is of a volume that is shown, dropped or incomplete.
    """
    faults = []
    if counts["damaged"] != sent["damaged"]:
        faults.append(f"{sent['damaged']} damaged volumes were sent and {counts['damaged']} passed over")
    frames = (sent["whole"] - counts["overtaken"]) * slices
    if totals["frames"] + totals["lost"] != frames:
        faults.append(f"{frames} frames were sent, {totals['frames']} arrived and {totals['lost']} were lost: "
                      f"{frames - totals['frames'] - totals['lost']} are missing")
    ended = totals["shown"] + totals["dropped"] + totals["incomplete"]
    arrived = -(-totals["frames"] // slices)
    if not totals["lost"] and ended != arrived:
        faults.append(f"{arrived} volumes arrived, and {totals['shown']} shown, {totals['dropped']} dropped and {totals['incomplete']} incomplete "
                      f"make {ended}")
    if totals["refused"]:
        faults.append(f"{totals['refused']} frames were refused")
    return faults


def exported(metrics, totals, faults):
    """Sentences about metrics that are not what the log says. `metrics`: counters by name, or None where the program has none."""
    if metrics is None:
        return []
    losses = sum(fault["kind"] in ("device_lost", "device_hung") for fault in faults)
    expected = {**{name: totals[name] for name in ("frames", "pictures", "shown", "dropped", "incomplete")}, "device_losses": losses}
    return [f"the metrics have {metrics.get(name, 'no')} {name}, not {value}" for name, value in expected.items() if metrics.get(name) != value]


def faults_table(faults):
    """Rows of (kind, number, not recovered, median and longest seconds to recover)."""
    rows = []
    for kind in sorted({fault["kind"] for fault in faults}):
        mine = [fault for fault in faults if fault["kind"] == kind]
        times = [fault["seconds"] for fault in mine if fault["seconds"] is not None]
        rows.append((kind, len(mine), sum(f["error"] is not None for f in mine), statistics.median(times) if times else None, max(times, default=None)))
    return rows


def verdict(result, limits):
    """Sentences about what is not as it must be; none if the soak passed."""
    wrong = list(result["accounts"])
    for fault in result["faults"]:
        if fault["error"]:
            wrong.append(f"{fault['kind']} at {fault['at']:.0f} s: {fault['error']}")
    for name, unit in [("memory", " MiB"), ("handles", ""), ("threads", "")]:
        growth = result[name]["growth"]
        if growth > limits[name]:
            wrong.append(f"{name} grew by {growth:.1f}{unit}, more than {limits[name]:g}")
    wrong += result["ends"]
    return wrong


def table(result):
    """The whole result as text."""
    lines = [f"{result['seconds'] / 60:.1f} min, seed {result['seed']}, {result['program']}", "",
             "| | first part | last part | slope there, an hour | growth, last to middle third | greatest |", "| --- | --- | --- | --- | --- | --- |"]
    for name, unit in [("memory", "MiB"), ("handles", ""), ("threads", ""), ("latency p50", "ms"), ("latency p95", "ms")]:
        one = result[name]
        lines.append(f"| {name}{', ' + unit if unit else ''} | {one['first']:.1f} | {one['last']:.1f} | {one['first_slope']:+.1f}, {one['last_slope']:+.1f} "
                     f"| {one['growth']:+.1f} | {one['greatest']:.1f} |")
    lines += ["", "| fault | times | not recovered | seconds to recover: median | longest |", "| --- | --- | --- | --- | --- |"]
    shown = lambda value: "-" if value is None else f"{value:.1f}"
    for kind, count, failed, median, longest in faults_table(result["faults"]):
        lines.append(f"| {kind} | {count} | {failed} | {shown(median)} | {shown(longest)} |")
    for kind, why in result["left_out"].items():
        lines.append(f"| {kind} | left out: {why} | | | |")
    sent, totals, counts = result["sent"], result["totals"], result["counts"]
    lines += ["", f"Volumes sent: {sent['whole']} whole, {sent['damaged']} damaged, {sent['cut']} cut short, over {sent['connections']} connections.",
              f"Passed over as damaged: {counts['damaged']}; dropped before they were taken: {counts['overtaken']}.",
              f"Frames: {totals['frames']} arrived, {totals['lost']} lost, {totals['refused']} refused, {totals['left_out']} of volumes that were over.",
              f"Volumes: {totals['shown']} shown, {totals['dropped']} dropped, {totals['incomplete']} incomplete. Pictures: {totals['pictures']}.",
              f"Processor time: {result['processor']:.2f} of a core. The thread that waited longest waited {result['waited']:.0f} s for a processor."]
    return "\n".join(lines)
