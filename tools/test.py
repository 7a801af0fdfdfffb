"""Run every test that this machine can, and say which ran: `make test`.

Core and shader tests run once, with the newest Python; Blender's tests run in each Blender that is set up.
Arguments go to pytest: `make test PYTEST_ARGS="-k name"`, `make test PYTEST_ARGS=tests/core/test_scene.py`.
"""

import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import environments

NO_TESTS_COLLECTED = 5


def parts():
    """(title, folder, Python version) of each run."""
    newest = environments.newest()
    yield f"Core (Python {newest})", "tests/core", newest
    yield f"Shaders (EGL, Python {newest})", "tests/shaders", newest
    for version, blender in environments.BLENDER_BY_PYTHON.items():
        yield f"{blender} (Python {version})", "tests/blender", version


def arguments_for(folder, arguments):
    """pytest's arguments for one part; None where the paths among them are all in other parts."""
    paths = [word for word in arguments if os.path.exists(word.split("::")[0])]
    if not paths:
        return [folder, *arguments]
    inside = [path for path in paths if (os.path.relpath(path) + os.sep).startswith(folder + os.sep)]
    return [*inside, *(word for word in arguments if word not in paths)] if inside else None


def counts(report):
    """The numbers in pytest's report, in words: "30 passed, 1 failed"."""
    try:
        suite = ElementTree.parse(report).getroot().find("testsuite")
    except (OSError, ElementTree.ParseError):
        return "no report"
    number = {name: int(suite.get(name)) for name in ("tests", "failures", "errors", "skipped")}
    number["passed"] = number["tests"] - number["failures"] - number["errors"] - number["skipped"]
    words = {"passed": "passed", "failures": "failed", "errors": "errors", "skipped": "skipped"}
    return ", ".join(f"{number[name]} {word}" for name, word in words.items() if number[name]) or "no tests"


def run_part(title, version, arguments):
    """(exit status, counts in words) of one pytest run."""
    print(f"\n=== {title} ===", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        report = os.path.join(folder, "report.xml")
        command = [str(environments.python(version)), "-m", "pytest", f"--junitxml={report}", *arguments]
        status = subprocess.run(command, env=environments.process_environment()).returncode
        return status, counts(report)


def run_all(arguments):
    """(summary lines, True where all is well)."""
    summary, failed, ran = [], False, False
    for title, folder, version in parts():
        own = arguments_for(folder, arguments)
        if version not in environments.ready():
            summary.append(f"{title}: not run, no Python {version} here")
            continue
        if own is None:
            summary.append(f"{title}: not run, not among the paths asked for")
            continue
        status, numbers = run_part(title, version, own)
        # A choice such as `-k name` may leave a part empty; without a choice, no tests is a mistake.
        chosen_elsewhere = status == NO_TESTS_COLLECTED and bool(arguments)
        ran = ran or not chosen_elsewhere
        failed = failed or (status != 0 and not chosen_elsewhere)
        mark = "" if status == 0 or chosen_elsewhere else f"  <-- FAILED (pytest's exit status {status})"
        summary.append(f"{title}: {'no test chosen' if chosen_elsewhere else numbers}{mark}")
    return summary, ran and not failed


def main():
    """Exit status: 0 where tests ran and none failed."""
    os.chdir(environments.REPOSITORY)
    try:
        summary, passed = run_all(sys.argv[1:])
    except KeyboardInterrupt:
        return 130
    print("\n=== What ran ===", *summary, "Passed." if passed else "FAILED.", sep="\n", flush=True)
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
