// A task as a group: this library on each target, whoever else has a call for it, and the copies.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <sstream>

#include "group.h"

namespace tessera::bench {
namespace {

// A 16:9 frame of which one image of this type is ten times the last-level cache.
Options::Size LargeSize(PixelType type) {
  const long cache = sysconf(_SC_LEVEL3_CACHE_SIZE);
  const double bytes = 10.0 * static_cast<double>(cache > 0 ? cache : 32L << 20);
  const double pixels = bytes / (4.0 * static_cast<double>(PixelBytes(type)));
  const int unit = static_cast<int>(std::ceil(std::sqrt(pixels / (16 * 9)) / 8)) * 8;
  return {unit * 16, unit * 9};
}

// The frame of the group that is being measured; the next group reuses inputs of equal shape.
struct FrameCache {
  std::vector<Image> inputs;
  bool own_inputs = false;  // made by the task

  Frame Make(const Task& task, const Options::Size& size, PixelType type, Content content = Content::kNoise) {
    const ImageSpec spec(size.width, size.height, 4, type);
    if (!inputs.empty() &&
        (own_inputs || task.make_input != nullptr || inputs[0].spec().data_window != spec.data_window ||
         inputs[0].spec().type != type)) {
      inputs.clear();
    }
    while (static_cast<int>(inputs.size()) < task.inputs()) {
      inputs.push_back(task.make_input != nullptr
                           ? task.make_input(size.width, size.height, type, inputs.size())
                           : MakeInput(size.width, size.height, type, inputs.size() + 1, content));
    }
    own_inputs = task.make_input != nullptr;
    Frame frame{size.width, size.height, type, {}, {}};
    frame.inputs.assign(inputs.begin(), inputs.begin() + task.inputs());
    std::vector<Node> nodes;
    for (const Image& image : frame.inputs) nodes.push_back(FromImage(image));
    ImageSpec result = task.Build(nodes, spec).spec();
    result.type = type;
    frame.output = Image(result);
    return frame;
  }
};

// Other ways of this library, and everybody else but the copies; null where one has no call for a task.
using Make = std::unique_ptr<Contestant> (*)(const Setting&);
constexpr Make kWays[] = {MakeInPlace,   MakeReads,      MakeRecursiveBlur, MakeDecimatedBlur,
                          MakeShortBlur, MakeMiddleBlur, MakeLongBlur,      MakeBoxesBlur};
constexpr Make kPeers[] = {MakeNewestOcio,   MakeOcio,           MakeOiio,  MakeOpenCv, MakeLibm,
                           MakeOiioResample, MakeOpenCvResample, MakeVips,  MakeZimg,   MakeStb,
                           MakeOpenCvFilter, MakeOiioFilter,     MakePixman};

struct TaskRun {
  Task task;
  Options options;
  Options::Size size;
  PixelType type;
  int threads;
  bool with_unfolded;

  std::vector<std::unique_ptr<Contestant>> Contestants(const Setting& setting) const {
    std::vector<std::unique_ptr<Contestant>> contestants;
    contestants.push_back(MakeCopy(setting, false));
    contestants.push_back(MakeCopy(setting, true));
    for (const std::string& target : options.targets) contestants.push_back(MakeTessera(setting, target));
    if (with_unfolded) contestants.push_back(MakeTessera(setting, options.targets.front(), false));
    const auto add = [&](const Make make) {
      if (auto contestant = make(setting)) contestants.push_back(std::move(contestant));
    };
    if (!options.alone) std::for_each(std::begin(kPeers), std::end(kPeers), add);
    std::for_each(std::begin(kWays), std::end(kWays), add);
    return contestants;
  }

  // Who takes part is known before pixels are: a small frame asks them.
  std::vector<std::string> Names() const {
    FrameCache tiny;
    const Frame frame = tiny.Make(task, {64, 64}, type);
    std::vector<std::string> names;
    for (const auto& c : Contestants({task, frame, threads})) names.push_back(c->Name());
    return names;
  }

  // Time is measured on noise; errors are the largest over pictures of every kind.
  void AddErrors(std::vector<Measured>& results) const {
    if (task.inputs() == 0 || task.make_input != nullptr) return;
    for (const Content content : kContents) {
      if (content == Content::kNoise) continue;
      FrameCache shown;
      const Frame frame = shown.Make(task, size, type, content);
      std::vector<Node> nodes;
      for (const Image& image : frame.inputs) nodes.push_back(FromImage(image));
      const Oracle oracle(task.Build(nodes, frame.output.spec()));
      for (const auto& contestant : Contestants({task, frame, threads})) {
        const auto result = std::find_if(results.begin(), results.end(), [&](const Measured& m) {
          return !m.is_copy && m.name == contestant->Name();
        });
        if (result == results.end()) continue;
        contestant->Prepare();
        contestant->Run();
        contestant->Finish();
        result->errors.Add(oracle.Compare(frame.output.view()));
      }
    }
  }

  Outcome Run() const {
    static FrameCache cache;
    const Frame frame = cache.Make(task, size, type);
    std::vector<Node> nodes;
    for (const Image& image : frame.inputs) nodes.push_back(FromImage(image));
    Outcome outcome;
    std::optional<Oracle> oracle;
    if (!options.alone) oracle.emplace(task.Build(nodes, frame.output.spec()));
    outcome.results = Measure(Contestants({task, frame, threads}), frame, oracle ? &*oracle : nullptr,
                              options.repetitions, options.seconds);
    if (!options.alone) AddErrors(outcome.results);
    outcome.type = type;
    outcome.pixels = static_cast<double>(frame.pixels());
    const double sample = static_cast<double>(PixelBytes(type)), pixel = 4 * sample;
    const ImageSpec& out = frame.output.spec();
    outcome.bytes_moved = pixel * static_cast<double>(frame.inputs.size()) * outcome.pixels +
                          sample * out.channel_count() * static_cast<double>(out.data_window.pixels());
    outcome.copy_bytes = 2 * pixel * outcome.pixels;
    return outcome;
  }
};

}  // namespace

void RegisterTask(const std::string& suite, const Task& task, const Options& options, bool with_unfolded) {
  for (const Options::Size& chosen : options.sizes) {
    for (PixelType type : options.types) {
      const Options::Size size = chosen.width ? chosen : LargeSize(type);
      for (int threads : options.threads) {
        const TaskRun run{task, options, size, type, threads, with_unfolded};
        std::ostringstream prefix;
        prefix << suite << '/' << task.name << '/' << PixelTypeName(type) << '/' << size.width << 'x'
               << size.height << "/threads:" << threads;
        RegisterGroup(prefix.str(), run.Names(), [run] { return run.Run(); });
      }
    }
  }
}

}  // namespace tessera::bench
