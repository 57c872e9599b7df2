"""`make lessons`: runs the lessons of fixtures/lessons, checks every figure and answer in their pages, and makes one page of
them, build/lessons/index.html.

    python3 tools/lessons                          all lessons
    python3 tools/lessons 06 12                    these
    python3 tools/lessons 06 --answer 3 0.25       whether that answers question 3 of lesson 6; runs nothing
"""
import argparse, shutil, sys, time
from pathlib import Path

import page
from checks import Wrong
from lesson import Lesson

TOP = Path(__file__).resolve().parents[2]
LESSONS = TOP / "fixtures/lessons"


def run_folder(where, wisp):
    """An empty folder in which a reader's commands run as they stand."""
    shutil.rmtree(where, ignore_errors=True)
    (where / "build").mkdir(parents=True)
    (where / "build/wisp").symlink_to(wisp.resolve())
    (where / "fixtures").symlink_to(TOP / "fixtures")
    return where


def check(lesson, where, wisp):
    """Whether all that the lesson shows is so. Prints a line that says it."""
    began, problems = time.monotonic(), []
    folder = run_folder(where, wisp)
    try:
        lesson.run(folder)
        lesson.check_prose()
        lesson.check_answers()
    except Wrong as wrong:
        problems = wrong.problems
    finally:
        (folder / "fixtures").unlink()
        shutil.rmtree(folder / "build")
    if not problems:
        for file in folder.iterdir():
            if file.suffix != ".png":  # which the page shows
                file.unlink()
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{lesson.name:20} {lesson.commands:3} commands {lesson.figures:4} figures {len(lesson.answers):3} answers "
          f"{time.monotonic() - began:6.1f} s  {'wrong' if problems else 'right'}", flush=True)
    return not problems


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lessons", nargs="*", metavar="NN", help="numbers of lessons, or how their names begin")
    parser.add_argument("--answer", nargs=2, metavar=("QUESTION", "ANSWER"))
    parser.add_argument("--wisp", type=Path, default=TOP / "build/wisp")
    parser.add_argument("--out", type=Path, default=TOP / "build/lessons")
    words = parser.parse_args()
    begins = tuple(word.zfill(2) if word.isdigit() else word for word in words.lessons)
    chosen = sorted(folder for folder in LESSONS.iterdir()
                    if folder.is_dir() and (not begins or folder.name.startswith(begins)))
    if not chosen:
        sys.exit(f"no lesson begins with {' or '.join(words.lessons)}")
    lessons = [Lesson(folder, TOP) for folder in chosen]
    if words.answer:
        question, answer = words.answer
        try:
            right = lessons[0].is_right(question, answer)
        except Wrong as wrong:
            sys.exit("\n".join(wrong.problems))
        print("right" if right else "not right")
        return 0 if right else 1
    began = time.monotonic()
    right = [check(lesson, words.out / lesson.name, words.wisp) for lesson in lessons]
    index = page.write(words.out, LESSONS, lessons)
    print(f"{sum(right)} of {len(right)} lessons are right: {sum(l.commands for l in lessons)} commands, "
          f"{sum(l.figures for l in lessons)} figures, {sum(len(l.answers) for l in lessons)} answers, "
          f"{time.monotonic() - began:.0f} s; the page is {index}")
    return 0 if all(right) else 1


if __name__ == "__main__":
    sys.exit(main())
