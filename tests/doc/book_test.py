#!/usr/bin/env python3
"""The book of doc/book: built small from the tool, whole, without dead links; and planted faults are told.

usage: book_test.py TESSERA SCENE FOLDER
"""
import html
import json
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BOOK = ROOT / "doc" / "book"
sys.dont_write_bytecode = True
sys.path.insert(0, str(BOOK))
import blocks  # noqa: E402
import check  # noqa: E402
import costs  # noqa: E402
import headers  # noqa: E402
import markdown  # noqa: E402

TOOL, SCENE, FOLDER = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def build(out, *more):
    line = [sys.executable, "-B", BOOK / "build.py", "--tool", TOOL, "--scene", SCENE, "--out", out, "--size", "160x100", *more]
    return subprocess.run([str(w) for w in line], capture_output=True, text=True, check=False)


class BookTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        cls.out = FOLDER / "book"
        cls.built = build(cls.out)
        print(cls.built.stdout, cls.built.stderr, file=sys.stderr)
        listed = subprocess.run([TOOL, "--list-commands:format=json"], capture_output=True, text=True, check=True).stdout
        cls.rows = json.loads(listed)

    def test_is_built(self):
        self.assertEqual(self.built.returncode, 0, self.built.stderr)
        self.assertFalse((FOLDER / "book.new").exists())

    def test_every_command_has_a_page_with_all_that_the_tool_says(self):
        lines = blocks.read(BOOK / "lines.txt")
        for row in self.rows:
            with self.subTest(row["name"]):
                page = (self.out / "op" / (row["name"].replace(" ", "-") + ".html")).read_text()
                text = html.unescape(re.sub(r"<[^>]+>", "", page))
                for words in [row["synopsis"], row["summary"], row["accuracy"], *row["help"].split("\n"),
                              *(p["help"] for p in row["arguments"] + row["modifiers"])]:
                    self.assertIn(words, text)
                self.assertIn('<pre class="line">', page)
                if row["group"].startswith("Operations") or row["group"] == "Patterns":
                    self.assertIn('<figure class="after">', page)
                    self.assertIn('id="cost"', page)
                    # A function of another name than its operation's is found where lines.txt says it.
                    self.assertTrue('id="cpp"' in page or row["name"] not in lines)

    def test_recipes_are_run_and_shown(self):
        recipes = sorted((BOOK / "recipes").glob("*.md"))
        self.assertGreaterEqual(len(recipes), 6)
        for recipe in recipes:
            page = (self.out / "recipe" / (recipe.stem + ".html")).read_text()
            self.assertEqual(page.count('<pre class="line">'), recipe.read_text().count("```sh"), recipe)
            self.assertIn('<figure><img src="../pictures/recipes/', page, recipe)
        # Against oiiotool itself, by lines that fail where the pictures differ.
        self.assertGreaterEqual((self.out / "recipe" / "from_oiiotool.html").read_text().count("PASS"), 5)

    def test_pictures_are_pictures(self):
        for file in (self.out / "pictures").rglob("*.*"):
            magic = {".jpg": b"\xff\xd8\xff", ".png": b"\x89PNG", ".svg": b"<"}[file.suffix]
            self.assertEqual(file.read_bytes()[:len(magic)], magic, file)

    def test_search_knows_every_page(self):
        text = (self.out / "search-index.js").read_text()
        entries = json.loads(text[text.index("["):text.rindex("]") + 1])
        pages = {str(f.relative_to(self.out)) for f in self.out.rglob("*.html")} - {"index.html"}
        self.assertEqual({e["u"] for e in entries}, pages)
        self.assertGreater(len(pages), len(self.rows))

    def test_no_dead_link(self):
        self.assertEqual(check.faults(self.out), [])

    def test_dead_links_anchors_and_pages_unknown_to_search_are_told(self):
        copy = FOLDER / "planted"
        shutil.copytree(self.out, copy)
        page = copy / "op" / "hue.html"
        page.write_text(page.read_text().replace("</main>", '<a href="gone.html">a</a><a href="saturate.html#gone">b</a></main>'))
        (copy / "op" / "more.html").write_text("<p>more</p>")
        told = check.faults(copy)
        self.assertEqual([t.split(":")[-1].strip() for t in told],
                         ["dead link gone.html", "dead anchor saturate.html#gone", "op/more.html is missing"])

    def planted(self, change):
        lines = FOLDER / "lines.txt"
        lines.write_text(change((BOOK / "lines.txt").read_text()))
        result = build(FOLDER / "unbuilt", "--lines", lines, "--only", "saturate")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertFalse((FOLDER / "unbuilt").exists())
        return result.stderr

    def test_a_command_without_a_line_is_told(self):
        told = self.planted(lambda text: re.sub(r"\nverify:.*?\n\n", "\n", text, flags=re.S))
        self.assertIn("no line for verify", told)

    def test_an_operation_without_a_line_is_shown_by_its_example(self):
        lines, out = FOLDER / "lines.txt", FOLDER / "examples"
        names = ["saturate", "over", "pattern checker"]
        text = (BOOK / "lines.txt").read_text()
        for name in names:
            text, count = re.subn(rf"\n{name}:.*?\n\n", "\n", text, flags=re.S)
            self.assertEqual(count, 1, name)
        lines.write_text(text)
        result = build(out, "--lines", lines, *(w for name in names for w in ("--only", name)))
        self.assertEqual(result.returncode, 0, result.stderr)
        for name, words in zip(names, ["photo.jpg --saturate ", "photo.jpg flower.jpg --over ", "--pattern checker"]):
            page = (out / "op" / (name.replace(" ", "-") + ".html")).read_text()
            self.assertIn('<pre class="line">tessera ' + words, page)
            self.assertIn('<figure class="after">', page)
            self.assertIn('id="cpp"', page)

    def test_a_line_that_fails_is_told(self):
        told = self.planted(lambda text: text.replace("--saturate 2 -o", "--saturate:weight=1 2 -o"))
        self.assertIn("--saturate:weight=1 2", told)
        self.assertIn("did you mean", told)

    def test_unknown_names_are_told(self):
        told = self.planted(lambda text: text.replace("c++ Saturate ", "c++ Saturation ") + "\nnothing: of that name\n  tessera\n")
        self.assertIn("Saturation", told)
        self.assertIn("nothing: no such command", told)


class PartsTest(unittest.TestCase):
    def test_markdown(self):
        text, title, headings = markdown.render(
            "# A `b`\n\nOne *two* **three** `a*b*c` [x](y.txt) a * b * c.\n\n    code <\n\n"
            "| a | b |\n|---|---|\n| 1 \\| 2 | 3 |\n\n- one\n  more\n- two\n", lambda t: t.replace(".txt", ".html"))
        self.assertEqual(title, "A b")
        self.assertEqual(headings, [(1, "A `b`", "a-b")])
        self.assertIn('<p>One <em>two</em> <strong>three</strong> <code>a*b*c</code> <a href="y.html">x</a> a * b * c.</p>', text)
        self.assertIn("<pre>code &lt;</pre>", text)
        self.assertIn("<td>1 | 2</td><td>3</td>", text)
        self.assertIn("<li>one more</li><li>two</li>", text)

    def test_declarations(self):
        found = list(headers.declarations(
            "/// What it is. @file\n\n/// A.\nstruct P {\n  int a = 1;  ///< a number\n};\n/// F,\n/// of two.\n"
            "Node F(const Node& a,\n       int b = 2);\nNode F(int);\n\nNode G(int);\n", "x.h"))
        self.assertEqual([(d.name, d.comment) for d in found], [("P", "A."), ("F", "F, of two."), ("F", "F, of two."), ("G", "")])
        self.assertIn("int b = 2);", found[1].code)

    def test_costs_of_the_readme_and_of_json(self):
        table = costs.Costs(ROOT / "README.md")
        columns, rows, note = table.find("over", ["over"])
        self.assertEqual([r[0].split(",")[0] for r in rows], ["over"] * len(rows))
        self.assertIn("ns per pixel", note)
        self.assertIsNone(table.find("abs", []))
        with self.assertRaises(blocks.Trouble):
            table.find("over", ["no such row"])
        file = FOLDER / "bench.json"
        item = {"name": "ops/abs/float/64x64/threads:1/tessera AVX3/iterations:1", "run_type": "iteration",
                "ns_per_pixel": 0.7, "max_error": 0}
        file.write_text(json.dumps({"context": {"host_name": "here"}, "benchmarks": [item]}))
        columns, rows, note = costs.Costs(ROOT / "README.md", [file]).find("abs", [])
        self.assertEqual(rows, [["abs, float, 64x64, threads 1", "tessera AVX3", "0.70", "0.0e+00"]])
        self.assertIn("here", note)


if __name__ == "__main__":
    if not pathlib.Path("/usr/share/backgrounds/mate").is_dir():
        print("the Debian package mate-backgrounds is not installed")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
