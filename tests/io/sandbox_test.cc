// Files that are read in processes of their own: the same pixels and metadata, and readers that crash, hang,
// grow, lie or reach for more than their file are errors of the file. Such readers are hooked into
// OpenImageIO here.
#include "tessera/sandbox.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <thread>

#include "io/files.h"
#include "io/outcome.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"
#include "tessera/render.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using testing_io::FileTest;
using testing_io::SetContents;
using testing_io::WritePattern;

// Does what the file's first letter says, when it is opened or, for capitals, when a row is read.
class Hook final : public OIIO::ImageInput {
 public:
  const char* format_name() const override { return "hook"; }
  bool open(const std::string& name, OIIO::ImageSpec& spec) override {
    std::FILE* const stream = std::fopen(name.c_str(), "rb");
    if (stream == nullptr) return false;
    letter_ = std::fgetc(stream);
    std::fclose(stream);
    m_spec = OIIO::ImageSpec(64, 300, 3, OIIO::TypeDesc::UINT8);
    m_spec.attribute("letter", std::string(1, static_cast<char>(letter_)));
    if (letter_ == 'n') m_spec.width = -5;
    if (letter_ == 'y') m_spec.height = 2000000000, m_spec.y = 2000000000;
    if (letter_ == 'd') m_spec.deep = true;
    if (!Act(letter_, name)) return false;
    spec = m_spec;
    return true;
  }
  bool close() override { return true; }
  bool read_native_scanline(int /*subimage*/, int /*miplevel*/, int y, int /*z*/, void* data) override {
    if (y == 250 && letter_ >= 'A' && letter_ <= 'Z' && !Act(letter_ - 'A' + 'a', "")) return false;
    std::memset(data, y % 251, 64 * 3);
    return true;
  }

 private:
  bool Refused(bool done) {
    if (!done) errorfmt("refused, errno {}", errno);
    return done;
  }
  bool Act(int letter, const std::string& name) {
    switch (letter) {
      case 'c':
        ::signal(SIGSEGV, SIG_DFL);  // a sanitizer's own ends the process by itself
        ::raise(SIGSEGV);
        break;
      case 'a':
        std::abort();
      case 'x':
        ::_exit(0);
      case 'h':
        for (std::atomic<unsigned> turns = 0;;) ++turns;
      case 'm':
        for (;;) std::memset(::operator new (size_t{1} << 24), 1, size_t{1} << 24);
      case 'v':  // memory that is shared and has no file
        ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        break;
      case 'e':  // code
        ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        break;
      case 's':
        ::socket(AF_INET, SOCK_STREAM, 0);
        break;
      case 'f':
        ::fork();
        break;
      case 'k':
        ::kill(::getppid(), SIGTERM);
        break;
      case 'u':
        ::unlink(name.c_str());
        break;
      case 'w':
        return Refused(::write(::open(name.c_str(), O_RDONLY), "x", 1) == 1);
      case 'p':
        return Refused(::open("/etc/passwd", O_RDONLY) >= 0);
      case 'q':
        return Refused(::open(name.c_str(), O_RDWR) >= 0);
      case 't':  // its own threads, many times over
        for (int i = 0; i < 300; ++i) std::thread([] {}).join();
        break;
      case 'o':  // as many streams as it likes, one after the other
        for (int i = 0; i < 300; ++i) std::fclose(std::fopen(name.c_str(), "rb"));
        break;
    }
    return true;
  }

  int letter_ = 0;
};

void DeclareHook() {
  static const char* extensions[] = {"hook", nullptr};
  OIIO::declare_imageio_format(
      "hook", []() -> OIIO::ImageInput* { return new Hook; }, extensions, nullptr, nullptr, "");
}

class SandboxTest : public FileTest {
 protected:
  SandboxTest() { Use(Sandbox::kAll); }
  ~SandboxTest() override { Context::Default().SetPolicy({}); }

  static void Use(Sandbox sandbox, double seconds = 60) {
    Policy policy;
    policy.sandbox = sandbox, policy.reader_seconds = seconds, policy.reader_memory = int64_t{1} << 29;
    Context::Default().SetPolicy(policy);
  }
  // What reading a hooked file comes to: its pixels' bytes, or the reason of the refusal.
  std::string Hooked(const std::string& contents) {
    SetContents(Path("a.hook"), contents);
    try {
      const Image image = Render(Read(Path("a.hook"), {.formats = Formats::kAll}));
      return std::string(reinterpret_cast<const char*>(image.view().data), 64 * 300 * 3);
    } catch (const Error& e) {
      EXPECT_EQ(e.subject(), Path("a.hook"));
      EXPECT_NE(KindOf(e), ErrorKind::kUsage);
      return e.reason();
    }
  }
};

TEST_F(SandboxTest, ReadersThatBehaveAreRead) {
  Use(Sandbox::kOff);
  const std::string right = Hooked("good");
  ASSERT_EQ(right.size(), 64u * 300 * 3);
  for (const Sandbox sandbox : {Sandbox::kUnlisted, Sandbox::kAll}) {
    Use(sandbox);
    EXPECT_EQ(Hooked("good"), right);
    EXPECT_EQ(Hooked("threads"), right);
    EXPECT_EQ(Hooked("open"), right);
  }
}

TEST_F(SandboxTest, ReadersThatDoNot) {
  const std::string forbidden = "its reader asked the system for something that readers may not do";
  for (const bool late : {false, true}) {
    const auto hooked = [&](char letter) {
      return Hooked(std::string(1, late ? static_cast<char>(letter - 'a' + 'A') : letter));
    };
    EXPECT_THAT(hooked('c'), HasSubstr("its reader crashed (signal 11, Segmentation fault)"));
    EXPECT_THAT(hooked('a'), HasSubstr("its reader crashed (signal 6, Aborted)"));
    EXPECT_THAT(hooked('x'), HasSubstr("its reader ended by itself (0)"));
    for (const char letter : {'v', 'e', 's', 'f', 'k', 'u'})
      EXPECT_THAT(hooked(letter), HasSubstr(forbidden)) << letter;
    EXPECT_THAT(hooked('p'), HasSubstr("refused, errno 2"));  // there is no such file
  }
  EXPECT_THAT(Hooked("w"), HasSubstr(forbidden));
  EXPECT_THAT(Hooked("q"), HasSubstr("refused, errno 13"));
  EXPECT_TRUE(std::filesystem::exists(Path("a.hook")));
#if !defined(__SANITIZE_ADDRESS__)
  EXPECT_THAT(Hooked("m"), HasSubstr("its reader was refused memory; it may take 512 MiB"));
#endif
}

TEST_F(SandboxTest, ReadersThatTakeTheirTime) {
  for (const char* how : {"h", "H"}) {
    Use(Sandbox::kAll, 0.5);
    EXPECT_THAT(Hooked(how), HasSubstr("its reader has taken more than 0.5 s, and was ended"));
  }
}

TEST_F(SandboxTest, WhatReadersSayIsChecked) {
  EXPECT_THAT(Hooked("n"), HasSubstr("found -5 x 300 pixels"));
  EXPECT_THAT(Hooked("y"), HasSubstr("beyond 1073741824"));
  EXPECT_THAT(Hooked("d"), HasSubstr("deep"));
}

// Pixels, windows, channels and metadata; or the refusal: OpenImageIO does not read every IFF that it writes.
std::string AllOf(const std::string& file, const ReadOptions& options) try {
  const Node node = Read(file, options);
  const Image image = Render(node, node.spec().type);
  const ImageSpec& s = node.spec();
  std::string text(reinterpret_cast<const char*>(image.view().data),
                   static_cast<size_t>(s.data_window.pixels() * s.channel_count()) * PixelBytes(s.type));
  for (const int v :
       {s.data_window.x0, s.data_window.y0, s.data_window.x1, s.data_window.y1, s.display_window.x0,
        s.display_window.y0, s.display_window.x1, s.display_window.y1, s.alpha, static_cast<int>(s.type)})
    text += " " + std::to_string(v);
  for (const std::string& channel : s.channels) text += " " + channel;
  for (const Attribute& a : *s.metadata) {
    text += "\n" + a.name + " " + a.type + " ";
    for (const std::byte b : a.bytes) text += static_cast<char>(b);
    for (const std::string& t : a.strings) text += "," + t;
  }
  return text;
} catch (const Error& e) {
  return e.what();
}

// Every format that is written here, all layouts of EXR and TIFF that have codecs of ours, parts.
TEST_F(SandboxTest, PixelsAndMetadataAreTheSame) {
  std::vector<std::string> files;
  for (const char* name : {"a.exr", "a.png", "a.tif", "a.jpg", "a.dpx", "a.hdr", "a.gif", "a.bmp", "a.webp",
                           "a.jp2", "a.heic", "a.sgi", "a.ppm", "a.tga", "a.rla", "a.iff", "a.fits"}) {
    OIIO::ImageSpec spec(133, 311, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("Artist", "somebody");
    spec.attribute("ImageDescription", "of something");
    const auto out = OIIO::ImageOutput::create(name);
    if (!out || !out->open(Path(name), spec)) continue;  // OpenImageIO may be built without
    out->close();
    WritePattern(Path(name), {spec});
    files.push_back(name);
  }
  EXPECT_GT(files.size(), 12u);
  OIIO::ImageSpec large(1500, 2100, 4, OIIO::TypeDesc::HALF);  // several windows of shared memory
  large.x = -7, large.y = 13, large.full_x = 2, large.full_width = 999;
  OIIO::ImageSpec tiled(200, 333, 3, OIIO::TypeDesc::FLOAT);
  tiled.tile_width = tiled.tile_height = 64;
  const float matrix[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  tiled.attribute("worldToCamera", OIIO::TypeMatrix, matrix);
  const int window[2] = {3, 4};
  tiled.attribute("pair", OIIO::TypeDesc("int[2]"), window);
  WritePattern(Path("large.exr"), {large});
  WritePattern(Path("tiled.exr"), {tiled});
  WritePattern(Path("tiled.tif"), {tiled});
  for (const char* name : {"large.exr", "tiled.exr", "tiled.tif"}) files.push_back(name);

  for (const std::string& file : files) {
    for (const Codec codec : {Codec::kAuto, Codec::kOpenImageIO}) {
      for (const int enough : {0, 40}) {
        const ReadOptions options{
            .codec = codec, .formats = Formats::kAll, .enough_width = enough, .enough_height = enough};
        Use(Sandbox::kOff);
        const std::string right = AllOf(Path(file), options);
        Use(Sandbox::kAll);
        EXPECT_EQ(AllOf(Path(file), options), right) << file;
      }
    }
  }
  for (const std::string& file : files) EXPECT_EQ(Subimages(Path(file), Formats::kAll).size(), 1u) << file;
}

TEST_F(SandboxTest, DamageIsTheSameRefusal) {
  WritePattern(Path("a.exr"), {OIIO::ImageSpec(90, 200, 3, OIIO::TypeDesc::HALF)});
  WritePattern(Path("a.png"), {OIIO::ImageSpec(90, 200, 3, OIIO::TypeDesc::UINT8)});
  WritePattern(Path("a.tif"), {OIIO::ImageSpec(90, 200, 3, OIIO::TypeDesc::UINT8)});
  for (const char* name : {"a.exr", "a.png", "a.tif"}) {
    const std::string whole = testing_io::Contents(Path(name));
    for (int part = 0; part < 8; ++part) {
      SetContents(Path(name), whole.substr(0, whole.size() * static_cast<size_t>(part) / 8));
      Use(Sandbox::kOff);
      const std::string right = testing_io::OutcomeOf(Path(name), Codec::kAuto);
      Use(Sandbox::kAll);
      EXPECT_EQ(testing_io::OutcomeOf(Path(name), Codec::kAuto), right) << name << part;
    }
  }
  for (const std::string& name : {Path("gone.exr"), Path(".")})
    EXPECT_TRUE(testing_io::IsRefusal(testing_io::OutcomeOf(name, Codec::kAuto), name));
  SetContents(Path("empty.exr"), "");
  EXPECT_THAT(testing_io::OutcomeOf(Path("empty.exr"), Codec::kAuto), HasSubstr("found an empty file"));
}

// More files than processes that wait; one of them is another file by the time that it is read.
TEST_F(SandboxTest, ManyFilesAtOnce) {
  std::vector<Node> nodes;
  std::vector<std::string> files;
  for (int i = 0; i < 20; ++i) {
    files.push_back(Path(std::to_string(i) + ".png"));
    WritePattern(files.back(), {OIIO::ImageSpec(30 + i, 40, 3, OIIO::TypeDesc::UINT8)});
    nodes.push_back(Read(files.back()));
  }
  WritePattern(files[0], {OIIO::ImageSpec(333, 444, 3, OIIO::TypeDesc::UINT8)});
  try {
    Render(nodes[0]);
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("0.png: the file changed after its header was read"));
  }
  std::vector<std::thread> threads;
  for (size_t i = 1; i < nodes.size(); ++i) {
    threads.emplace_back([&, i] {
      const Image image = Render(nodes[i], PixelType::kUint8);
      for (int y = 0; y < 40; ++y) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_EQ(static_cast<int>(image.at<uint8_t>(29, y, c)),
                    static_cast<int>(testing_io::Sample(PixelType::kUint8, 29, y, c)[0]));
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(SandboxTest, SlicesOfAVolume) {
  for (int i = 1; i <= 3; ++i)
    WritePattern(Path("s" + std::to_string(i) + ".png"), {OIIO::ImageSpec(9, 7, 1, OIIO::TypeDesc::UINT8)});
  const Volume apart = ReadVolume(Path("s#.png"));
  Use(Sandbox::kOff);
  const Volume here = ReadVolume(Path("s#.png"));
  EXPECT_EQ(apart.spec().size, here.spec().size);
}

TEST_F(SandboxTest, NobodyReadsWhereThereIsNoSandbox) {
  WritePattern(Path("a.png"), {OIIO::ImageSpec(9, 7, 1, OIIO::TypeDesc::UINT8)});
  const Node before = Read(Path("a.png"));
  EndSandbox();
  for (const char* name : {"a.png"}) {
    EXPECT_THAT(testing_io::OutcomeOf(Path(name), Codec::kAuto),
                HasSubstr("is to be read in a sandbox, and it was ended"));
  }
  EXPECT_THROW(Render(before), Error);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "processes are left";
  Use(Sandbox::kUnlisted);
  EXPECT_EQ(testing_io::OutcomeOf(Path("a.png"), Codec::kAuto).size(), 63u);
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
#if defined(__SANITIZE_THREAD__)
  std::puts("skipped: the sanitizer's own thread is there from the start");
  return argc > 0 && argv != nullptr ? 0 : 1;
#else
  tessera::DeclareHook();
  tessera::StartSandbox();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
#endif
}
