"""Lessons made up here: what is right passes, and each wrong figure is found, with its line."""
import tempfile, unittest
from pathlib import Path

from checks import Wrong, agrees, computed
from lesson import Lesson

PAGE = """# A lesson

Three of 8 are 37.5 %, and {prose} bytes were read.

    cat counts.txt
    bytes read {printed}
    cat counts.json
    shadow.rays 12
    3 / 8 = {quotient}

## Questions

1. How many bytes?
"""
RIGHT = {"prose": "1,234", "printed": "1234", "quotient": "0.375", "answer": "1234"}


def problems(**words):
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        (top / "lesson/solution").mkdir(parents=True)
        (top / "lesson/README.md").write_text(PAGE.format(**{**RIGHT, **words}))
        (top / "lesson/solution/README.md").write_text("# Answers\n\n    answer 1 = {answer}\n".format(**{**RIGHT, **words}))
        (top / "counts.txt").write_text("files 3\nbytes read  1234, all of them\n")
        (top / "counts.json").write_text('{ "frames": [{ "shadow": { "rays": 12 } }] }')
        try:
            lesson = Lesson(top / "lesson", top)
            lesson.run(top)
            lesson.check_prose()
            lesson.check_answers()
        except Wrong as wrong:
            return wrong.problems
        return ()


class Lessons(unittest.TestCase):
    def test_right(self):
        self.assertEqual(problems(), ())

    def test_each_wrong_figure(self):
        for name, wrong, line in (("prose", "1,235", 3), ("printed", "1235", 6), ("quotient", "0.376", 9)):
            found = problems(**{name: wrong})
            self.assertEqual(len(found), 1, name)
            self.assertRegex(found[0], rf"^lesson/README.md:{line}: expected .*, found .*")
        self.assertIn("found `bytes read 1234, all of them`", problems(printed="1235")[0])
        self.assertRegex(problems(answer="8")[0], r"^lesson/solution/README.md:3: ")

    def test_a_question_without_an_answer(self):
        self.assertIn("questions 1, but answers ", problems(answer="")[0])

    def test_an_answer(self):
        with tempfile.TemporaryDirectory() as name:
            (Path(name) / "lesson/solution").mkdir(parents=True)
            (Path(name) / "lesson/README.md").write_text(PAGE.format(**RIGHT))
            (Path(name) / "lesson/solution/README.md").write_text("    answer 1 = 1234\n    answer 2 = 5.4 %\n")
            lesson = Lesson(Path(name) / "lesson", Path(name))
        for question, answer, right in (("1", "1,234", True), ("1", "1235", False), ("2", "5.4", True), ("2", "5.42%", True),
                                        ("2", "0.054", True), ("2", "0.54", False)):
            self.assertEqual(lesson.is_right(question, answer), right, answer)
        for question, answer in (("3", "1"), ("1", "many")):
            self.assertRaises(Wrong, lesson.is_right, question, answer)

    def test_numbers(self):
        self.assertTrue(agrees("0.14", 0.1353) and agrees("6.2e-7", 6.229e-7))
        self.assertFalse(agrees("0.136", 0.1353))
        self.assertAlmostEqual(computed("2 * exp(-0.5 * 2)^2"), 0.2706705664)
        self.assertEqual(computed("1,000 / 8"), 125)
        self.assertIsNone(computed("open('x')"))


if __name__ == "__main__":
    unittest.main()
