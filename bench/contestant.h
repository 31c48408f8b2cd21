// Anything that can compute a task: this library, a peer, or the copy.
#ifndef TESSERA_BENCH_CONTESTANT_H_
#define TESSERA_BENCH_CONTESTANT_H_

#include <memory>
#include <string>
#include <vector>

#include "task.h"

namespace tessera::bench {

class Contestant {
 public:
  virtual ~Contestant() = default;
  // "tessera AVX3", "OpenColorIO"; no '/' or ':'.
  virtual std::string Name() const = 0;
  // Untimed, before every turn: settings that belong to the process, such as thread counts.
  virtual void Prepare() {}
  // Timed: reads the frame's inputs, writes the frame's output, or a layout that its author would rather
  // write.
  virtual void Run() = 0;
  // Untimed, where that layout becomes the frame's output.
  virtual void Finish() {}
  // A yardstick has no error of its own to report.
  virtual bool IsCopy() const { return false; }
};

// Task, frame and thread count outlive the contestants made for them.
struct Setting {
  const Task& task;
  const Frame& frame;
  int threads = 1;
};

// Each returns null when it has no public call for the task and pixel type.
std::unique_ptr<Contestant> MakeOiio(const Setting& setting);
std::unique_ptr<Contestant> MakeNewestOcio(
    const Setting& setting);  // null when only the shipped one is there
std::unique_ptr<Contestant> MakeOcio(const Setting& setting);
std::unique_ptr<Contestant> MakeLibm(const Setting& setting);
std::unique_ptr<Contestant> MakeOpenCv(const Setting& setting);  // null when built without OpenCV
std::unique_ptr<Contestant> MakeOiioResample(const Setting& setting);
std::unique_ptr<Contestant> MakeOpenCvResample(const Setting& setting);
std::unique_ptr<Contestant> MakeVips(const Setting& setting);  // these three: null when built without them
std::unique_ptr<Contestant> MakeZimg(const Setting& setting);
std::unique_ptr<Contestant> MakeStb(const Setting& setting);

// The filters' peers, and other ways of this library to the same blur: recursive, decimated, cut off at two,
// three, four sigma, three boxes.
std::unique_ptr<Contestant> MakeOpenCvFilter(const Setting& setting);  // null when built without OpenCV
std::unique_ptr<Contestant> MakeOiioFilter(const Setting& setting);
std::unique_ptr<Contestant> MakeRecursiveBlur(const Setting& setting);
std::unique_ptr<Contestant> MakeDecimatedBlur(const Setting& setting);
std::unique_ptr<Contestant> MakeShortBlur(const Setting& setting);
std::unique_ptr<Contestant> MakeMiddleBlur(const Setting& setting);
std::unique_ptr<Contestant> MakeLongBlur(const Setting& setting);
std::unique_ptr<Contestant> MakeBoxesBlur(const Setting& setting);

// Compositing's: pixman (null when built without it), this library in place as pixman works, and the
// yardstick of two or sixteen images read and one written.
std::unique_ptr<Contestant> MakePixman(const Setting& setting);
std::unique_ptr<Contestant> MakeInPlace(const Setting& setting);
std::unique_ptr<Contestant> MakeReads(const Setting& setting);

// Name and version of every peer that was built in, for the report's heading.
std::vector<std::pair<std::string, std::string>> PeerVersions();

// This library on one compiled target ("AVX2"); without `optimize` nothing is folded.
std::unique_ptr<Contestant> MakeTessera(const Setting& setting, const std::string& target,
                                        bool optimize = true);

// The copy of input 0 (of the output, for a generator) to the output: memcpy, or streaming.
std::unique_ptr<Contestant> MakeCopy(const Setting& setting, bool streaming);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_CONTESTANT_H_
