// Grids of OpenVDB files, a few slices at a time, voxel for voxel as the library itself has them: in this
// process and in one of its own.
#include <array>
#include <cstdlib>
#include <fstream>

#include "files.h"
#include "tessera/context.h"
#include "tessera/sandbox.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

using namespace testing_io;
using ::testing::HasSubstr;

class VdbTest : public FileTest, public ::testing::WithParamInterface<Sandbox> {
 protected:
  VdbTest() {
    before_ = Context::Default().policy();
    Policy policy = before_;
    policy.sandbox = GetParam();
    Context::Default().SetPolicy(policy);
  }
  ~VdbTest() override { Context::Default().SetPolicy(before_); }

  void SetUp() override { ASSERT_EQ(std::system((TESSERA_VDB_GRIDS " '" + Path("") + "'").c_str()), 0); }

  Policy before_;
};

TEST_P(VdbTest, GridsOfManySlabs) {
  for (const std::string name : {"surface", "ramp"}) {
    VolumeFileParams params;
    params.part = name;
    const Volume volume = ReadVolume(Path("a.vdb"), params);
    std::ifstream stream(Path(name + ".raw"), std::ios::binary);
    std::array<int32_t, 3> size{};
    stream.read(reinterpret_cast<char*>(size.data()), sizeof size);
    ASSERT_EQ(volume.spec().size, (std::array<int, 3>{size[0], size[1], size[2]})) << name;
    std::vector<float> row(static_cast<size_t>(size[0]));
    int64_t other = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        stream.read(reinterpret_cast<char*>(row.data()), static_cast<std::streamsize>(row.size() * 4));
        for (int i = 0; i < size[0]; ++i) other += volume.At(i, j, k) != row[static_cast<size_t>(i)];
      }
    }
    ASSERT_TRUE(stream) << name;
    EXPECT_EQ(other, 0) << name;
  }
  EXPECT_THAT(ErrorOf([&] { ReadVolume(Path("a.vdb"), {.part = "smoke"}); }),
              HasSubstr("expected one of ramp, surface"));
}

TEST_P(VdbTest, GridsOfOtherTypes) {
  EXPECT_THAT(ErrorOf([&] { ReadVolume(Path("whole.vdb")); }), HasSubstr("expected one of floats"));
}

INSTANTIATE_TEST_SUITE_P(Sandboxes, VdbTest, ::testing::Values(Sandbox::kOff, Sandbox::kAll));

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
#if defined(__SANITIZE_THREAD__)
  std::puts("skipped: the sanitizer's own thread is there from the start");
  return argc > 0 && argv != nullptr ? 0 : 1;
#else
  tessera::StartSandbox();  // before there are threads
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
#endif
}
