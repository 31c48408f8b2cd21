// Graphs over files, read in bands of any height, against the same over pixels in memory.
#include "files.h"
#include "ops/registry.h"
#include "support/test_ops.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using namespace testing_io;
using OIIO::TypeDesc;
using testing::ExpectSameBits;
using testing::UnifyNans;

struct File {
  const char* name;
  TypeDesc::BASETYPE base;
  int channels;
  int tile = 0;
  int x = 0, y = 0;
};
void PrintTo(const File& f, std::ostream* out) {
  *out << f.name << " " << TypeDesc(f.base).c_str() << " " << f.channels << " tile " << f.tile;
}

class FileSources : public FileTest, public ::testing::WithParamInterface<File> {};
INSTANTIATE_TEST_SUITE_P(
    Formats, FileSources,
    ::testing::Values(File{"a.tif", TypeDesc::UINT8, 4}, File{"a.tif", TypeDesc::UINT16, 3},
                      File{"a.tif", TypeDesc::FLOAT, 5}, File{"t.tif", TypeDesc::UINT8, 3, 16},
                      File{"t.tif", TypeDesc::FLOAT, 4, 32}, File{"a.exr", TypeDesc::HALF, 4, 0, -9, 5},
                      File{"t.exr", TypeDesc::HALF, 4, 16, 7, -11}, File{"t.exr", TypeDesc::FLOAT, 6, 24},
                      File{"a.png", TypeDesc::UINT8, 3}, File{"a.png", TypeDesc::UINT16, 1}));

struct Words {
  const char* op;
  const char* arguments;
};

Node ApplyAll(const std::vector<Words>& all, Node node) {
  for (const Words& words : all) {
    const ops::OpInfo* const info = ops::FindOp(words.op);
    if (info == nullptr) throw Error(words.op, "is no operation");
    node = info->make(std::vector{node}, ops::ParseExample(*info, words.arguments), nullptr);
  }
  return node;
}

TEST_P(FileSources, GiveThePixelsOfMemory) {
  const File f = GetParam();
  OIIO::ImageSpec spec(83, 71, f.channels, f.base);
  spec.x = f.x, spec.y = f.y;
  spec.full_x = f.x, spec.full_y = f.y;
  if (f.tile > 0) spec.tile_width = spec.tile_height = f.tile;
  spec.alpha_channel = -1;  // colours are not multiplied by it
  const std::string file = Path(f.name);
  WritePattern(file, {spec});
  if (HasFatalFailure()) return;
  const Node node = Read(file);
  ASSERT_EQ(node.spec().channel_count(), f.channels);
  // The same pixels; the file's channels may have been sorted by name.
  const Image whole = Render(node, node.spec().type);
  const Image pattern = Pattern(node.spec());
  ExpectSameBits(whole, pattern);
  const Node memory = FromImage(pattern);

  std::vector<std::vector<Words>> graphs = {{},
                                            {{"mulc", "0.5"}},
                                            {{"blur", "9x9"}},
                                            {{"median", "3x5"}, {"invert", ""}},
                                            {{"shift", "3,-2 border=repeat"}},
                                            {{"ch", "0"}},
                                            {{"crop", "40x33+11+20"}},
                                            {{"crop", "-20,-20,120,100"}}};
  if (f.channels >= 3) {
    graphs.insert(graphs.end(),
                  {{{"ch", "1,2"}}, {{"ch", "2,1"}, {"blur", "3x7"}}, {{"ch", "2"}, {"median", "3x3"}}});
  }
  for (const auto& words : graphs) {
    for (const PixelType type : {node.spec().type, PixelType::kFloat}) {
      const Image want = Render(ApplyAll(words, memory), type);
      UnifyNans(want);
      for (const int rows : {0, 1, 5, 13, 29}) {
        for (const int threads : {1, 3}) {
          SCOPED_TRACE((words.empty() ? "nothing" : std::string(words[0].op) + " " + words[0].arguments) +
                       " to " + PixelTypeName(type) + ", " + std::to_string(rows) + " rows, " +
                       std::to_string(threads) + " threads");
          const Image got = Render(ApplyAll(words, node), type, {.threads = threads, .tile_height = rows});
          UnifyNans(got);
          ExpectSameBits(got, want);
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera
