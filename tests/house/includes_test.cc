// The rooms of the house: who may include whom. Fails on an upward edge, on a library outside its room, on a
// public header that needs more than the standard library, on a file that has grown too long.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace tessera::house {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kMaxLines = 500;

// The rooms below each room. Of the operations, those above see the registry, and the other words for its
// parameters.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"base", {}},
    {"model", {"base/"}},
    {"simd", {"base/"}},
    {"sched", {"base/"}},
    {"graph", {"base/", "simd/", "sched/"}},
    {"ops", {"base/", "model/", "simd/", "graph/"}},
    {"reference", {"base/", "model/"}},
    {"verify", {"base/", "model/", "simd/", "sched/", "graph/", "reference/", "ops/registry.h"}},
    {"io", {"base/", "model/", "simd/", "sched/", "graph/"}},
    {"ocio", {"base/", "model/", "simd/", "graph/", "ops/registry.h"}},
    {"vdb", {"base/", "model/"}},
    {"json", {"base/", "graph/", "ops/apply.h", "ops/registry.h"}},
    {"c", {"base/", "ops/apply.h", "ops/registry.h", "ops/wrap.h"}},
    {"python", {"graph/", "ops/apply.h", "ops/registry.h", "ops/wrap.h"}},
    {"cli",
     {"base/", "graph/", "io/video/y4m.h", "ops/apply.h", "ops/registry.h", "ops/wrap.h",
      "sched/scheduler.h"}},
};

// Headers of simd/ that are written in Highway: at home where Highway is.
const std::vector<std::string> kHighwayHomes = {"src/simd/", "src/ops/"};

// Libraries: where their headers may be included. A folder ends in a slash.
struct Library {
  std::string prefix;
  std::vector<std::string> homes;
};
const std::vector<Library> kLibraries = {
    {"hwy/", kHighwayHomes},
    {"tbb/", {"src/sched/tbb_scheduler.cc"}},
    {"oneapi/", {"src/sched/tbb_scheduler.cc"}},
    {"OpenImageIO/", {"src/io/", "src/cli/", "include/tessera/oiio_adapter.h"}},
    {"libdeflate.h", {"src/io/codec/"}},
    {"openexr", {"src/io/codec/"}},
    {"tiffio.h", {"src/io/codec/"}},
    {"seccomp.h", {"src/io/sandbox/"}},
    {"openvdb/", {"src/vdb/"}},
    {"pybind11/", {"src/python/"}},
    {"OpenColorIO/", {"src/ocio/", "include/tessera/ocio_adapter.h"}},
};

// Public headers of one room's work, or with a foreign type in them, and the rooms that may see them.
const std::map<std::string, std::set<std::string>> kForeignHeaders = {
    {"tessera/io.h", {"io", "json", "cli", "c", "python"}},
    {"tessera/oiio_adapter.h", {"io"}},
    {"tessera/tessera.h", {"cli"}},
    {"tessera/ocio.h", {"ocio", "cli"}},
    {"tessera/ocio_adapter.h", {"ocio"}},
};

bool StartsWith(const std::string& s, const std::string& prefix) {
  return s.compare(0, prefix.size(), prefix) == 0;
}

// True when one of `homes` is the file itself or a folder that it is in.
bool AtHome(const std::string& file, const std::vector<std::string>& homes) {
  return std::any_of(homes.begin(), homes.end(), [&](const std::string& home) {
    return home.back() == '/' ? StartsWith(file, home) : file == home;
  });
}

struct Source {
  std::string path;  // from the root, with slashes
  int lines = 0;
  bool comment_first = false, guarded = false;
  int exported = 0, closed = 0, namespaces = 0;  // marks of tessera/export.h that stand where they should
  struct Include {
    std::string name;
    bool quoted = false;
  };
  std::vector<Include> includes;
};

Source Scan(const fs::path& root, const fs::path& file) {
  Source source;
  source.path = fs::relative(file, root).generic_string();
  std::ifstream stream(file);
  for (std::string line, before; std::getline(stream, line); before = line) {
    source.namespaces += StartsWith(line, "namespace tessera");
    source.exported += StartsWith(line, "namespace tessera") && before == "TESSERA_API_BEGIN";
    source.closed += line == "TESSERA_API_END" && StartsWith(before, "}  // namespace tessera");
    if (++source.lines == 1) source.comment_first = StartsWith(line, "//");
    source.guarded |= StartsWith(line, "#ifndef TESSERA_") || StartsWith(line, "#if defined(TESSERA_");
    const size_t hash = line.find_first_not_of(" \t");
    if (hash == std::string::npos || line[hash] != '#') continue;
    const size_t word = line.find_first_not_of(" \t", hash + 1);
    if (word == std::string::npos || line.compare(word, 7, "include") != 0) continue;
    const size_t open = line.find_first_of("<\"", word);
    const size_t close = open == std::string::npos ? open : line.find_first_of(">\"", open + 1);
    if (close == std::string::npos) continue;  // a macro
    source.includes.push_back({line.substr(open + 1, close - open - 1), line[open] == '"'});
  }
  return source;
}

std::vector<Source> ScanTree(const fs::path& root) {
  std::vector<Source> sources;
  for (const char* folder : {"include", "src", "tests", "bench", "samples"}) {
    if (!fs::exists(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cc") sources.push_back(Scan(root, entry.path()));
    }
  }
  std::sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) { return a.path < b.path; });
  return sources;
}

// The part of a path before the first slash.
std::string Head(const std::string& path) { return path.substr(0, path.find('/')); }

// Why a file of src/ may not include `name`, or nothing. `inside` is the file's path below src/.
std::string Objection(const std::string& inside, const std::string& name) {
  const std::string room = Head(inside);
  if (StartsWith(name, "tessera/")) {
    if (const auto foreign = kForeignHeaders.find(name); foreign != kForeignHeaders.end()) {
      return foreign->second.count(room) ? "" : "is not for " + room + "/";
    }
    const bool parameters = StartsWith(name, "tessera/ops/");
    const bool engine =
        std::set<std::string>{"base", "simd", "sched", "graph", "io", "verify"}.count(room) > 0;
    return parameters && engine ? room + "/ knows no operation by name" : "";
  }
  const std::string target = Head(name);
  const auto allowed = kMayInclude.find(room);
  if (allowed == kMayInclude.end()) return room + "/ is no known room";
  if (!kMayInclude.count(target)) return "is in no known room";
  if (target == room) return "";
  if (allowed->second.count(target + "/") || allowed->second.count(name)) return "";
  return "is an upward edge from " + room + "/";
}

// Every breach of the rules below `root`, one line each.
std::vector<std::string> Breaches(const fs::path& root) {
  std::vector<std::string> breaches;
  for (const Source& source : ScanTree(root)) {
    const auto breach = [&](const std::string& what) { breaches.push_back(source.path + ": " + what); };
    const bool is_public = StartsWith(source.path, "include/"), is_private = StartsWith(source.path, "src/");
    if (source.lines > kMaxLines)
      breach(std::to_string(source.lines) + " lines, at most " + std::to_string(kMaxLines));
    if (!source.comment_first) breach("does not start with a comment that says what it is");
    const bool header = source.path.ends_with(".h");
    if (header && (is_public || is_private) && !source.guarded) breach("has no TESSERA_ include guard");
    if (is_public && (source.exported < source.namespaces || source.closed < source.namespaces)) {
      breach("hides a namespace in shared libraries: TESSERA_API_BEGIN before it, TESSERA_API_END behind it");
    }
    if (!is_public && !is_private) continue;
    for (const auto& include : source.includes) {
      for (const Library& library : kLibraries) {
        if (StartsWith(include.name, library.prefix) && !AtHome(source.path, library.homes)) {
          breach("includes " + include.name + ", a library outside its room");
        }
      }
      const bool foreign = kForeignHeaders.count(source.path.substr(source.path.find('/') + 1)) > 0;
      if (is_public && !foreign) {
        // Standard headers have neither folder nor extension.
        const bool standard = include.name.find_first_of("/.") == std::string::npos ||
                              include.name == "stddef.h" || include.name == "stdint.h";  // for C
        const bool own = StartsWith(include.name, "tessera/") && !kForeignHeaders.count(include.name);
        if (!standard && !own) breach("public header includes " + include.name);
      } else if (is_public && include.quoted && !StartsWith(include.name, "tessera/")) {
        breach("public header includes " + include.name);
      }
      if (include.name.ends_with("-inl.h") && !AtHome(source.path, kHighwayHomes)) {
        breach("includes " + include.name + ", written in Highway");
      }
      if (is_private && include.quoted && !StartsWith(include.name, "hwy/")) {
        const std::string objection = Objection(source.path.substr(std::string("src/").size()), include.name);
        if (!objection.empty()) breach("includes " + include.name + ", which " + objection);
      }
    }
  }
  return breaches;
}

TEST(IncludesTest, HouseIsInOrder) {
  const std::vector<Source> sources = ScanTree(TESSERA_SOURCE_DIR);
  ASSERT_GT(sources.size(), 40u) << "the tree was not found";
  EXPECT_THAT(Breaches(TESSERA_SOURCE_DIR), IsEmpty());
}

// A tree of one good house, into which each test plants one fault.
class PlantedTest : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(::testing::TempDir()) / ("tessera_house_" + std::to_string(std::random_device{}()));
    Plant("include/tessera/roi.h", "#include <vector>");
    Plant("include/tessera/oiio_adapter.h", "#include <OpenImageIO/imagebuf.h>\n#include \"tessera/roi.h\"");
    Plant("include/tessera/io.h", "#include \"tessera/roi.h\"");
    Plant("src/base/tile.h", "#include \"tessera/roi.h\"");
    Plant("src/simd/point-inl.h", "#include \"hwy/highway.h\"\n#include \"base/tile.h\"");
    Plant("src/graph/render.cc", "#include \"simd/pixels.h\"\n#include \"sched/scheduler.h\"");
    Plant("src/ops/color/hue.cc",
          "#include \"graph/op.h\"\n#include \"ops/registry.h\"\n#include \"simd/point-inl.h\"");
    Plant("src/sched/tbb_scheduler.cc", "#include <tbb/parallel_for.h>");
    Plant("src/reference/color.cc", "#include \"tessera/ops/color.h\"\n#include \"reference/reference.h\"");
    Plant("src/io/write.cc", "#include \"tessera/io.h\"\n#include \"graph/source.h\"");
    Plant("src/cli/main.cc", "#include \"ops/registry.h\"\n#include \"tessera/tessera.h\"");
  }
  void TearDown() override { fs::remove_all(root_); }

  void Plant(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << "// A planted file.\n#ifndef TESSERA_PLANTED_H_\n" << text << "\n#endif\n";
  }
  void ExpectBreach(const std::string& path, const std::string& text, const std::string& what) {
    Plant(path, text);
    const std::vector<std::string> breaches = Breaches(root_);
    EXPECT_THAT(breaches, Contains(HasSubstr(path + ": "))) << text;
    EXPECT_THAT(breaches, Contains(HasSubstr(what))) << text;
    fs::remove(root_ / path);
  }

  fs::path root_;
};

TEST_F(PlantedTest, GoodHousePasses) { EXPECT_THAT(Breaches(root_), IsEmpty()); }

TEST_F(PlantedTest, UpwardEdgesAreFound) {
  ExpectBreach("src/base/bad.cc", "#include \"graph/op.h\"", "upward edge from base/");
  ExpectBreach("src/graph/bad.cc", "#include \"ops/registry.h\"", "upward edge from graph/");
  ExpectBreach("src/simd/bad.h", "#include \"sched/scheduler.h\"", "upward edge from simd/");
  ExpectBreach("src/base/bad.cc", "#include \"model/volume_data.h\"", "upward edge from base/");
  ExpectBreach("src/graph/bad.cc", "#include \"model/volume_data.h\"", "upward edge from graph/");
  ExpectBreach("src/reference/bad.cc", "#include \"ops/shade/fog_terms.h\"", "upward edge from reference/");
  ExpectBreach("src/graph/bad.cc", "  #  include \"reference/reference.h\"", "upward edge from graph/");
  ExpectBreach("src/graph/bad.cc", "#include \"tessera/ops/color.h\"", "knows no operation by name");
  ExpectBreach("src/sched/bad.cc", "#include \"graph/plan.h\"", "upward edge from sched/");
  ExpectBreach("src/reference/bad.cc", "#include \"simd/pixels.h\"", "upward edge from reference/");
  ExpectBreach("src/ops/color/bad.cc", "#include \"reference/reference.h\"", "upward edge from ops/");
  ExpectBreach("src/simd/bad.h", "#include \"graph/op.h\"", "upward edge from simd/");
  ExpectBreach("src/verify/bad.cc", "#include \"ops/color/affine.h\"", "upward edge from verify/");
  ExpectBreach("src/cli/bad.cc", "#include \"ops/color/hue.h\"", "upward edge from cli/");
  ExpectBreach("src/ops/color/bad.cc", "#include \"ocio/ocio_ops.h\"", "upward edge from ops/");
  ExpectBreach("src/ops/registry.cc", "#include \"ocio/config.h\"", "upward edge from ops/");
  ExpectBreach("src/ocio/bad.cc", "#include \"ops/color/affine.h\"", "upward edge from ocio/");
  ExpectBreach("src/attic/bad.cc", "#include \"base/tile.h\"", "no known room");
}

TEST_F(PlantedTest, LibrariesOutsideTheirRoomAreFound) {
  ExpectBreach("src/graph/bad.cc", "#include <hwy/highway.h>", "a library outside its room");
  ExpectBreach("src/graph/bad.cc", "#include \"simd/point-inl.h\"", "written in Highway");
  ExpectBreach("src/sched/bad.cc", "#include <tbb/parallel_for.h>", "a library outside its room");
  ExpectBreach("src/graph/bad.cc", "#include <OpenImageIO/imageio.h>", "a library outside its room");
  ExpectBreach("src/io/bad.cc", "#include <libdeflate.h>", "a library outside its room");
  ExpectBreach("src/graph/bad.cc", "#include \"tessera/io.h\"", "is not for graph/");
  ExpectBreach("src/cli/bad.cc", "#include \"tessera/oiio_adapter.h\"", "is not for cli/");
  ExpectBreach("src/cli/bad.cc", "#include <OpenColorIO/OpenColorIO.h>", "a library outside its room");
}

TEST_F(PlantedTest, PublicHeadersWithMoreThanTheStandardLibraryAreFound) {
  ExpectBreach("include/tessera/bad.h", "#include <OpenImageIO/imagebuf.h>", "public header includes");
  ExpectBreach("include/tessera/bad.h", "#include \"graph/op.h\"", "public header includes graph/op.h");
  ExpectBreach("include/tessera/bad.h", "#include \"tessera/io.h\"", "public header includes tessera/io.h");
  ExpectBreach("include/tessera/ocio.h", "#include <OpenColorIO/OpenColorIO.h>",
               "a library outside its room");
  ExpectBreach("include/tessera/ops/bad.h", "#include <hwy/highway.h>", "public header includes");
}

TEST_F(PlantedTest, PublicNamespacesThatSharedLibrariesHideAreFound) {
  const std::string end = "}  // namespace tessera\n";
  ExpectBreach("include/tessera/bad.h", "namespace tessera {\n" + end, "hides a namespace");
  ExpectBreach("include/tessera/bad.h", "TESSERA_API_BEGIN\nnamespace tessera {\n" + end,
               "hides a namespace");
  Plant("include/tessera/good.h", "TESSERA_API_BEGIN\nnamespace tessera {\n" + end + "TESSERA_API_END");
  EXPECT_THAT(Breaches(root_), IsEmpty());
}

TEST_F(PlantedTest, UntidyFilesAreFound) {
  std::string lines;
  for (int i = 0; i < kMaxLines; ++i) lines += "int x" + std::to_string(i) + ";\n";
  ExpectBreach("src/base/bad.cc", lines, "lines, at most 500");
  fs::create_directories(root_ / "src/base");
  std::ofstream(root_ / "src/base/bare.h") << "int x;\n";
  EXPECT_THAT(Breaches(root_),
              Contains("src/base/bare.h: does not start with a comment that says what it is"));
  EXPECT_THAT(Breaches(root_), Contains("src/base/bare.h: has no TESSERA_ include guard"));
}

}  // namespace
}  // namespace tessera::house
