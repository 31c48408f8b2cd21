// File to file in bounded memory: a picture larger than the budget passes in bands, and stays what it was.
#include <sys/resource.h>

#include <atomic>

#include "files.h"
#include "graph/render.h"

namespace tessera {
namespace {

using namespace testing_io;

// A source that is never resident: 400 MB of pixels made as they are asked for.
class EndlessSource final : public graph::PixelSource {
 public:
  EndlessSource() : spec_(5000, 5000, 4, PixelType::kFloat) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "made"; }
  std::unique_ptr<graph::RowReader> Open(int, int) const override {
    class Reader final : public graph::RowReader {
      void Read(const ImageView& out) override {
        for (int y = out.roi.y0; y < out.roi.y1; ++y) {
          auto* row = reinterpret_cast<float*>(out.At(0, y));
          std::fill_n(row, 5000 * static_cast<size_t>(out.channels), static_cast<float>(y));
        }
      }
    };
    return std::make_unique<Reader>();
  }

 private:
  ImageSpec spec_;
};

class StreamTest : public FileTest {};

TEST_F(StreamTest, APictureLargerThanTheBudgetPassesInBands) {
  WriteOptions options;
  options.render.memory_budget = size_t{32} << 20;
  const auto peak = [] {
    rusage usage;
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;  // kilobytes
  };
  const long before = peak();
  Write(graph::MakeSource(std::make_shared<EndlessSource>()), Path("a.tif"), options);
  Write(Read(Path("a.tif")), Path("b.exr"), options);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(peak() - before, 200 * 1024) << "of a picture of 390,625 KB";
#else
  (void)before;
#endif
  const Node result = Read(Path("b.exr"));
  const auto reader = SourceOf(result).Open(0, 4);
  std::vector<float> row(20000);
  for (const int y : {0, 1, 2499, 4998, 4999}) {
    reader->Read(
        ImageView(reinterpret_cast<std::byte*>(row.data()), {0, y, 5000, y + 1}, 4, PixelType::kFloat));
    EXPECT_EQ(row, std::vector<float>(20000, static_cast<float>(y)));
  }
}

}  // namespace
}  // namespace tessera
