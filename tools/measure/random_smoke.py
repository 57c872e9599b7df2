"""`make random-smoke`: smoke scenes drawn from a seed, rendered by every method in three arithmetics, held against --reference.

    python3 tools/measure/random_smoke.py [--seed S] [--scenes N] [--from I] [--scene I] [--every] [-j N] [--wisp PROGRAM]

`--scene I` renders that scene alone, keeps its files in random_smoke/S.I beside the program, and prints every command.

Each scene is rendered by the default way, by those of single scattering, and by two others that are dealt, with --every by all.
Exit 1 where there is a fault: a deviation without a warning, arithmetics that disagree, a crash, a pixel that is no number, a
refusal in one arithmetic alone that does not name it. Counted are other refusals, with their reasons, runs that take more than
TIMEOUT seconds, and scenes of which a way warns that it errs by so much "or more". Where it warns that it errs by up to so much,
it is held to that: its bound of the mean is larger by that, its bound of the parts by twice that.

A scene deviates by a method where the relative error is more than the method's bound by LIMIT standard errors, in two tests: the
first with few passes and seeds, the second with other ones, of which there are more. Errors are those of the picture's mean (three
channels) and of its BLOCKS x BLOCKS parts, each as a vector d with the reference's r and the standard errors s of d:
(|d| - bound |r|) / |s|. s has the spread of the seeds and the standard error of the reference. Where that is heavy-tailed (a light
in smoke, |g| near 1) the first test may be wrong by chance, hence the second. Arithmetics disagree in two tests as well: in the
pictures of one seed, then in the means of others.
"""
import argparse, json, math, multiprocessing, re, shlex, shutil, signal, statistics, sys
from collections import Counter, defaultdict
from pathlib import Path

from harness import WISP, plain, read_pfm, run_process
from smoke_scenes import Scene

# Method: options; whether it traces photons; bounds of the relative error of the picture's mean, and of its parts; and up to which
# optical depth within a smoothing length they are promised.
PHOTONS, SEEDS = 12288, 4
METHODS = {
    "default": ("", True, 0.03, 0.06, math.inf),
    "map exact": ("--smoke map --density-step 0", True, 0.10, 0.20, 0.4),
    "map uneven": ("--irradiance adaptive", True, 0.03, 0.06, math.inf),
    "map no lattice": ("--irradiance none", True, 0.10, 0.20, 0.4),
    "volume": ("--smoke volume", True, 0.15, 0.30, 0.4),
    "direct": ("--smoke direct", True, 0.15, 0.30, 0.4),
    "direct no lattice": ("--smoke direct --irradiance none", True, 0.15, 0.30, 0.4),
    "single": ("--photons 0", False, 0.03, 0.06, math.inf),
    "single exact": ("--photons 0 --smoke map --density-step 0", False, 0.03, 0.06, 1),
    "single direct": ("--photons 0 --smoke direct --step 0.1 --light-step 0", False, 0.01, 0.02, 5),
}
# How much f32 and fixed may differ from f64: of the brightness, and of the noise where random numbers are drawn; and by itself.
ARITHMETICS = "f64", "f32", "fixed"
# Rounding sends photons other ways, so two pictures may be independent: they then differ by 1.4 times the noise of one.
# Of smoke of optical depth D a place is rounded to D times as many mean free paths.
ROUNDING, OF_DEPTH, OF_NOISE, QUANTUM = 5e-4, 2e-6, 4, 5e-7
LIMIT = 4  # standard errors
# What is drawn sends about BRIGHT, so a reference that missed the one path of N which does is off by 1/N of it. Errors are relative
# to no less than DARK.
BRIGHT, DARK = 1, 1e-4
BLOCKS = 4
TIMEOUT, MEMORY = 20, "1G"
# The reference: passes of the pilot, the relative noise of the mean that suffices, and the work (its counters) that is enough.
PILOT, NOISE, WORK = 16, 0.004, 1.2e6


def norm(values):
    return math.sqrt(math.fsum(x * x for x in values))


def mean_of(samples):
    return [[statistics.fmean(column) for column in zip(*(sample[which] for sample in samples))] for which in (0, 1)]


def spread(samples, which):
    """The standard deviation of one picture."""
    return norm([statistics.stdev(c) for c in zip(*(sample[which] for sample in samples))])


def block_means(path, squared=False):
    """The picture's mean, then those of its blocks, three channels each; of standard errors the root of the sum of squares."""
    width, height, _, values = read_pfm(path)
    sums, counts = [0.0] * (3 * BLOCKS * BLOCKS), [0] * (BLOCKS * BLOCKS)
    for pixel in range(width * height):
        block = pixel // width * BLOCKS // height * BLOCKS + pixel % width * BLOCKS // width
        counts[block] += 1
        for c in range(3):
            sums[3 * block + c] += values[3 * pixel + c] ** (2 if squared else 1)
    whole = [math.fsum(sums[c::3]) for c in range(3)]
    root = math.sqrt if squared else float
    return [root(x) / (width * height) for x in whole], [root(x) / counts[i // 3] for i, x in enumerate(sums)]


class Trial:
    """The runs of one scene, and what is wrong with them."""

    def __init__(self, seed, number, verbose, every, wisp):
        self.folder, self.verbose, self.wisp = Path(wisp).parent / "random_smoke" / f"{seed}.{number}", verbose, wisp
        self.seed, self.number, self.every = seed, number, every
        self.scene = Scene(seed, number, self.folder)
        self.faults = []  # (kind, method, arithmetic, text, how bad)
        self.errors = {}  # method: what excess() gives
        self.rounding = {}  # (method, arithmetic): difference from f64 over what is allowed, and relative
        self.endless = set()  # methods that did not end once, and are not tried again
        self.refused = []
        self.deeper = []  # methods that promise nothing here
        self.warned = {}  # method: the error that it warned of, without end for one of so much "or more"
        self.costs = []  # (bytes, seconds, method)

    def fault(self, kind, method, arithmetic, text, size=math.inf):
        self.faults.append((kind, method, arithmetic, text, size))

    def render(self, method, arithmetic, *options, kind="all"):
        """Means of a picture, or None where there is none, which is noted."""
        if method in self.endless:
            return None
        picture = self.folder / "picture.pfm"
        picture.unlink(missing_ok=True)
        command = [self.wisp, "render", self.folder / f"{kind}.aff", "--arith", arithmetic, *options, "--memory", MEMORY,
                   "-o", picture]
        limited = ["prlimit", f"--cpu={TIMEOUT}:{TIMEOUT + 5}", *command]
        status, _, processor, resident, _, complaint = run_process(limited, 20 * TIMEOUT)
        self.costs.append((resident, processor, method))
        if self.verbose:
            print(f"{processor:8.3f} s {resident / 1e6:7.1f} MB  {shlex.join(map(str, command))}")
        lines = [line for line in complaint.strip().splitlines() if "warning:" not in line]
        if status in (None, -signal.SIGXCPU):
            self.endless.add(method)
        elif status in (2, 3, 4) and len(lines) == 1:
            self.refused.append((method, arithmetic, status, lines[0].replace(str(self.folder), "")))
        elif status != 0:
            self.fault("crash", method, arithmetic, f"status {status}: " + " / ".join(lines[-2:]))
        else:
            # Noise is no error of the method: seeds tell how much there is.
            for up_to, percent in re.findall(r"warning: .* likely (up to )?([0-9.]+) % (?!wrong here, by noise)", complaint):
                self.warned[method] = max(self.warned.get(method, 0), float(percent) / 100 if up_to else math.inf)
            values = read_pfm(picture)[3]
            if all(math.isfinite(x) and x >= 0 for x in values):
                return block_means(picture)
            self.fault("not finite", method, arithmetic, f"{sum(not (math.isfinite(x) and x >= 0) for x in values)} values")
        return None

    def reference(self, kind, arithmetic, passes):
        """Means of a reference and their standard errors, and its work."""
        errors, stats = self.folder / "errors.pfm", self.folder / "stats.json"
        means = self.render("reference", arithmetic, "--reference", "--passes", "{}:{}".format(*passes), "--error-out", errors,
                            "--stats", stats, kind=kind)
        if not means:
            return None
        frame = json.loads(stats.read_text())["frames"][0]
        work = frame["rays"]["primary"] + frame["rays"]["shadow"] + frame["smoke"]["density_evaluations"]
        noise = [[math.hypot(x, BRIGHT / frame["rays"]["primary"]) for x in part] for part in block_means(errors, squared=True)]
        return means, noise, work * (1 + frame["smoke"]["particles"] / 10)

    def truth(self, kind, power=1):
        """A reference in f64 of as many passes as are worth it, none of which the pilot or the first test has traced."""
        pilot = self.reference(kind, "f64", (0, PILOT))
        if not pilot:
            return None
        noise = norm(pilot[1][0]) / (norm(pilot[0][0]) or 1)
        wanted = min(max(1, (noise / NOISE) ** 2 if noise else 16), WORK / (pilot[2] + 1), 4096)
        passes = max(1, int(wanted)) * PILOT
        first = PILOT if power == 1 else PILOT + passes
        return self.reference(kind, "f64", (first, first + power * passes))

    def excess(self, samples, truth, bounds):
        """By how many standard errors the mean of samples is off by more than the bounds; then of the picture's mean the chi-square
        per value, the relative error and its noise."""
        excesses, figures = [], None
        for which, bound in enumerate(bounds):
            columns = list(zip(*(sample[which] for sample in samples)))
            spread = [statistics.variance(c) / len(c) if len(c) > 1 else 0 for c in columns]
            d = [statistics.fmean(c) - r for c, r in zip(columns, truth[0][which])]
            r, s = norm(truth[0][which]), math.sqrt(math.fsum(spread) + norm(truth[1][which]) ** 2)
            r += DARK
            s = max(s, 1e-6 * r)
            excesses.append((norm(d) - bound * r) / s)
            figures = figures or (norm(d) ** 2 / s ** 2, math.copysign(norm(d) / r, sum(d)), s / r)
        return max(excesses), *figures

    def hold(self, method):
        """One method: f32 against the reference, the other arithmetics against f32 (f64 for f32 where that is refused)."""
        options, photons, *bounds, deepest = METHODS[method]
        options = [*options.split(), *(["--photons", PHOTONS] if photons else [])]
        orders = "all" if photons else "single"
        truth = self.truths[orders]
        first = {a: self.render(method, a, *options) for a in ARITHMETICS}
        arithmetic = next((a for a in ("f32", "f64", "fixed") if first[a]), None)
        if not arithmetic or not truth:
            return
        seeds = range(2, SEEDS + 1) if photons else ()
        samples = [first[arithmetic], *(self.render(method, arithmetic, *options, "--seed", seed) for seed in seeds)]
        if None in samples:
            return
        warned = self.warned.get(method, 0)
        bounds = [bound + factor * warned for factor, bound in zip((1, 2), bounds)]
        result = self.excess(samples, truth, bounds)
        if self.scene.grain > deepest or warned == math.inf:
            self.deeper.append(method)
            result = None
        elif result[0] > LIMIT:
            result = self.second_test(arithmetic, options, orders, bounds) or result
            if result[0] > LIMIT:
                self.fault("deviates", method, arithmetic, f"mean {100 * result[2]:+.3g} % +- {100 * result[3]:.2g} %, "
                           f"{result[0]:.3g} standard errors beyond the bound", result[0])
        if result:
            self.errors[method] = result
        noise = [spread(samples, which) if photons else 0 for which in (0, 1)]
        if self.scene.grain <= deepest:
            self.hold_arithmetics(method, first, noise, options if photons else None)

    def hold_arithmetics(self, method, means, noise, options=None):
        """What each arithmetic makes of the same random numbers against f64; `noise` is that of one picture. With `options` a
        disagreement is tested again."""
        if not means["f64"]:
            return
        for arithmetic in ARITHMETICS[1:]:
            if means[arithmetic]:
                worst = self.disagreement(means["f64"], means[arithmetic], noise)
                if worst[0] > 1 and options is not None:
                    pair = [self.second_samples(a, options, "all") for a in ("f64", arithmetic)]
                    if None not in pair[0] + pair[1]:
                        noise_of_means = [math.hypot(*(spread(samples, which) / math.sqrt(len(samples)) for samples in pair))
                                          for which in (0, 1)]
                        worst = self.disagreement(*map(mean_of, pair), noise_of_means)
                self.rounding[method, arithmetic] = worst[:2]
                if worst[0] > 1:
                    self.fault("arithmetic", method, arithmetic, worst[2], worst[0])

    def disagreement(self, f64, other, noise):
        """The larger of two, the picture's mean and its parts: the difference over what is allowed, and relative, and both in
        words."""
        found = []
        for which, name in enumerate(("mean", "parts")):
            right = norm(f64[which]) + DARK
            d = norm([a - b for a, b in zip(other[which], f64[which])]) / right
            allowed = ROUNDING + OF_DEPTH * self.scene.depth + (OF_NOISE * noise[which] + QUANTUM) / right
            found.append((d / allowed, d, f"{name} {100 * d:.3g} % off f64, allowed {100 * allowed:.2g} %"))
        return max(found)

    def second_samples(self, arithmetic, options, orders):
        seeds = range(SEEDS + 1, 3 * SEEDS + 1) if orders == "all" else [1]
        return [self.render("second test", arithmetic, *options, "--seed", seed) for seed in seeds]

    def second_test(self, arithmetic, options, orders, bounds):
        if (orders, 2) not in self.truths:
            self.truths[orders, 2] = self.truth(orders, 4)
        samples = self.second_samples(arithmetic, options, orders)
        return self.excess(samples, self.truths[orders, 2], bounds) if self.truths[orders, 2] and None not in samples else None

    def run(self):
        orders = ["all", "single"] if self.scene.has_single else ["all"]
        self.truths = {kind: self.truth(kind) for kind in orders}
        pilots = {a: self.reference("all", a, (0, PILOT)) for a in ARITHMETICS}
        self.hold_arithmetics("reference", {a: p and p[0] for a, p in pilots.items()},
                              [norm(pilots["f64"][1][which]) for which in (0, 1)] if pilots["f64"] else [])
        dealt = [method for method in METHODS if METHODS[method][1]][1:]
        dealt = [self.scene.draw.deals(f"method {i}", *dealt) for i in range(2)]
        for method, (_, photons, *_) in METHODS.items():
            if method == "default" or self.every or (method in dealt if photons else "single" in orders):
                self.hold(method)
        refused = defaultdict(dict)
        for method, arithmetic, status, reason in self.refused:
            refused[method][arithmetic] = status, reason
        for method, reasons in refused.items():
            for arithmetic, (status, reason) in reasons.items():
                # Numbers of f64 take more memory.
                named = status == 4 or arithmetic.replace("fixed", "fixed point") in reason or "arithmetic" in reason
                if len(reasons) < 3 and method != "second test" and not named:
                    self.fault("refused alone", method, arithmetic, reason)
        if not self.verbose:
            shutil.rmtree(self.folder)
        return self


def trial(arguments):
    try:
        result = Trial(*arguments).run()
    except Exception as error:
        raise RuntimeError(f"scene {arguments[1]} of seed {arguments[0]}") from error
    result.said, result.elements = "; ".join(result.scene.said), result.scene.elements
    del result.scene
    return result


def print_rows(header, rows):
    rows = [[plain(cell, 3) for cell in row] for row in [header, *rows]]
    widths = [max(len(row[i]) for row in rows) for i in range(len(header))]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())


def report(trials):
    rows = []
    for method, (_, _, mean, parts, deepest) in METHODS.items():
        results = [(t.errors[method], t.number) for t in trials if method in t.errors]
        if results:
            (_, _, error, noise), number = max(results, key=lambda r: abs(r[0][2]) - 3 * r[0][3])
            rows.append([method, f"{100 * mean:g}, {100 * parts:g} %" + (f" to {deepest}" if deepest < math.inf else ""),
                         sum(method in t.deeper for t in trials), len(results),
                         sum(f[:2] == ("deviates", method) for t in trials for f in t.faults),
                         statistics.median(r[1] / 3 for r, _ in results),
                         f"{100 * statistics.median(abs(r[2]) for r, _ in results):.2g} %",
                         f"{100 * error:+.3g} +- {100 * noise:.2g} %", str(number)])
    print_rows(["method", "bounds, to depth", "deeper or warned", "held", "deviate", "chi2/3, median", "error, median", "largest",
                "of scene"], rows)
    print("\narithmetics against f64:")
    rows = []
    for method in (*METHODS, "reference"):
        for arithmetic in ARITHMETICS[1:]:
            results = [(*t.rounding[method, arithmetic], t.number) for t in trials if (method, arithmetic) in t.rounding]
            if results:
                worst = max(results)
                rows.append([method, arithmetic, len(results), sum(r[0] > 1 for r in results),
                             f"{100 * statistics.median(r[1] for r in results):.2g} %", f"{100 * worst[1]:.3g} %", worst[0],
                             str(worst[2])])
    print_rows(["method", "arithmetic", "scenes", "beyond", "median", "worst", "over allowed", "of scene"], rows)
    print("\nrefused:")
    reasons = Counter((status, reason.split(": ", 1)[-1]) for t in trials for _, _, status, reason in t.refused)
    print_rows(["runs", "status", "reason"], [[n, str(status), reason] for (status, reason), n in reasons.most_common(12)])
    endless = [f"{method} of scene {t.number}" for t in trials for method in sorted(t.endless)]
    print(f"\nnot done after {TIMEOUT} s of the processor:", ", ".join(endless) or "none")
    print("\nmost memory, and most time of one run:")
    for which in (0, 1):
        most = [(max(t.costs, key=lambda cost: cost[which]), t) for t in trials]
        for (resident, seconds, method), t in sorted(most, key=lambda m: -m[0][which])[:5]:
            print(f"  {resident / 1e6:8.1f} MB  {seconds:7.2f} s  {t.elements:5} particles and cells  scene {t.number}: {method}")
    faults = sorted(((fault, t) for t in trials for fault in t.faults), key=lambda f: (f[0][0], -f[0][4]))
    print(f"\n{len(faults)} faults in {len({t.number for _, t in faults})} of {len(trials)} scenes, the worst first of each kind:")
    for (kind, method, arithmetic, text, _), t in faults:
        print(f"  {kind}: --seed {t.seed} --scene {t.number}: {method}, {arithmetic}: {text}   [{t.said}]")
    return bool(faults)


def main():
    parser = argparse.ArgumentParser()
    for name, default in (("--seed", 1), ("--scenes", 200), ("--from", 0), ("--scene", None), ("-j", 1)):
        parser.add_argument(name, type=int, default=default, dest=name.strip("-"))
    parser.add_argument("--every", action="store_true")
    parser.add_argument("--wisp", default=WISP)
    options = parser.parse_args()
    one = options.scene is not None
    numbers = [options.scene] if one else range(vars(options)["from"], vars(options)["from"] + options.scenes)
    print(f"seed {options.seed}, scenes {numbers[0]} to {numbers[-1]}", flush=True)
    trials = []
    with multiprocessing.Pool(options.j) as pool:
        for t in pool.imap(trial, [(options.seed, number, one, options.every, options.wisp) for number in numbers]):
            trials.append(t)
            faults = (" ".join(map(str, fault[:4])) for fault in t.faults)
            print(f"{t.number}: {sum(c[1] for c in t.costs):.1f} s, {t.said}", *faults, sep="\n    ", file=sys.stderr, flush=True)
    sys.exit(report(trials))


main()
