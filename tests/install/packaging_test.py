#!/usr/bin/env python3
"""What packages are made of: one version everywhere, what is asked for is what the build asks for, files that parse.

usage: packaging_test.py
"""
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CMAKE = (ROOT / "CMakeLists.txt").read_text()
VERSION = re.search(r"project\(tessera VERSION ([0-9.]+)", CMAKE)[1]

# What CMakeLists.txt looks for, by Debian's name and conda-forge's.
NEEDED = {
    "OpenImageIO": ("libopenimageio-dev", "openimageio"), "OpenColorIO": ("libopencolorio-dev", "opencolorio"),
    "TBB": ("libtbb-dev", "tbb-devel"), "nlohmann_json": ("nlohmann-json3-dev", "nlohmann_json"),
    "hwy": ("libhwy-dev", "libhwy"), "DEFLATE": ("libdeflate-dev", "libdeflate"),
    "XXHASH_HEADERS": ("libxxhash-dev", "xxhash"), "OPENEXR_CORE": ("libopenexr-dev", "openexr"),
    "OPENEXR_HEADERS": ("libopenexr-dev", "openexr"), "TIFF": ("libtiff-dev", "libtiff"),
    "JPEG": ("libjpeg-dev", "libjpeg-turbo"), "SECCOMP_LIBRARY": ("libseccomp-dev", "libseccomp"),
}


def rendered(text):
    """A conda recipe without its Jinja: variables put in, compilers named."""
    for name, value in re.findall(r'{% set (\w+) = "([^"]*)" %}', text):
        text = text.replace("{{ %s }}" % name, value)
    text = re.sub(r"{%.*%}", "", text)
    return re.sub(r'{{ compiler\("(\w+)"\) }}', r"compiler-\1", text)


class PackagingTest(unittest.TestCase):
    def setUp(self):
        self.recipe = (ROOT / "packaging/conda/meta.yaml").read_text()
        self.container = (ROOT / "packaging/container/Containerfile").read_text().replace("\\\n", " ")

    def test_there_is_one_version(self):
        self.assertRegex(VERSION, r"^\d+\.\d+\.\d+$")
        self.assertIn(f'{{% set version = "{VERSION}" %}}', self.recipe)
        self.assertIn(f"\nversion: {VERSION}\n", (ROOT / "CITATION.cff").read_text())
        self.assertIn(f"\n## {VERSION}", (ROOT / "CHANGELOG.md").read_text())

    def test_all_that_is_needed_is_asked_for(self):
        looked_for = set(re.findall(r"(?m)^find_package\((\w+) REQUIRED", CMAKE))
        looked_for |= set(re.findall(r"(?m)^find_(?:library|path)\((\w+) [^)]*REQUIRED", CMAKE))
        self.assertLessEqual(looked_for, set(NEEDED))
        setup = (ROOT / "samples/setup.sh").read_text()
        for debian, conda in NEEDED.values():
            self.assertRegex(self.container, rf"\s{re.escape(debian)}\s")
            self.assertRegex(setup, rf"\s{re.escape(debian)}\s")
            self.assertIn(f"\n    - {conda}\n", self.recipe)

    def test_the_recipe_parses(self):
        try:
            import yaml
        except ImportError:
            self.skipTest("no PyYAML")
        recipe = yaml.safe_load(rendered(self.recipe))
        self.assertEqual((recipe["package"]["name"], recipe["package"]["version"]), ("tessera", VERSION))
        self.assertTrue((ROOT / "packaging/conda" / recipe["source"]["path"] / "CMakeLists.txt").exists())
        self.assertTrue((ROOT / recipe["about"]["license_file"]).exists())
        for template in (ROOT / ".github/ISSUE_TEMPLATE").glob("*.md"):
            head = yaml.safe_load(template.read_text().split("---")[1])
            self.assertEqual(set(head), {"name", "about", "labels"}, template)

    def test_scripts_parse_and_options_exist(self):
        script = ROOT / "packaging/conda/build.sh"
        subprocess.run(["sh", "-n", str(script)], check=True)
        for option in re.findall(r"-D(TESSERA_\w+)=", script.read_text()):
            self.assertRegex(CMAKE, rf"option\({option}\b")

    def test_the_container_is_made_of_stages(self):
        stages, known = set(), {"FROM", "RUN", "COPY", "WORKDIR", "ENTRYPOINT", "CMD"}
        for line in self.container.splitlines():
            if not line.strip() or line.startswith("#"):
                continue
            word, rest = line.split(" ", 1)
            self.assertIn(word, known)
            if word == "FROM":
                self.assertRegex(rest, r"^debian:bookworm(-slim)?( AS \w+)?$")
                stages |= set(re.findall(r" AS (\w+)", rest))
            for stage in re.findall(r"--from=(\w+)", rest):
                self.assertIn(stage, stages)
            for preset in re.findall(r"--preset (\w+)", rest):
                self.assertIn(f'{{"name": "{preset}", "inherits"', (ROOT / "CMakePresets.json").read_text())
            if word == "RUN":
                subprocess.run(["sh", "-nc", rest], check=True)


if __name__ == "__main__":
    unittest.main(verbosity=2)
