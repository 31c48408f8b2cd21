// Evaluation for Python: rendering, writing, verifying, with signals and progress looked after.
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "python/core.h"
#include "tessera/cost.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/metadata.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera::python {
namespace {

constexpr auto kLook = std::chrono::milliseconds(20);  // how often signals are looked for

RenderOptions OptionsOf(const py::dict& given) {
  RenderOptions options;
  const auto take = [&given](const char* name, auto& value) {
    if (given.contains(name)) value = given[name].cast<std::remove_reference_t<decltype(value)>>();
  };
  take("threads", options.threads), take("memory", options.memory_budget);
  take("tile_width", options.tile_width), take("tile_height", options.tile_height);
  take("optimize", options.optimize), take("rules_off", options.rules_off);
  return options;
}

bool IsMainThread() {
  const py::object main = py::module_::import("threading").attr("main_thread")().attr("ident");
  return !main.is_none() && main.cast<unsigned long>() == PyThread_get_thread_ident();
}

// What the thread that computes and the one that waits for it share.
struct Shared {
  std::atomic<bool> stop = false;
  std::atomic<double> share = 0;
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::exception_ptr failure;
};

// Has Python's handlers run and the progress function told; false where it says so.
bool Look(const py::object& progress, double share) {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (progress.is_none()) return true;
  const py::object answer = progress(share);
  return answer.is_none() || answer.cast<bool>();
}

py::dict DictOf(const RunStats& stats) {
  py::list passes;
  for (const RunStats::Pass& p : stats.passes) {
    py::dict pass;
    pass["name"] = p.name, pass["seconds"] = p.seconds, pass["pixels"] = p.pixels, pass["bytes"] = p.bytes;
    passes.append(pass);
  }
  const RunPhases& phases = stats.phases;
  double decode = 0;
  for (const RunPhases::Decode& d : phases.decode) decode += d.busy;
  py::dict d;
  d["passes"] = passes, d["rules"] = stats.rules, d["files"] = stats.files;
  d["threads"] = phases.threads, d["seconds"] = phases.seconds;
  d["prepare"] = phases.prepare, d["decode"] = decode, d["compute"] = phases.compute;
  d["encode"] = phases.encode, d["wait"] = phases.wait, d["limit"] = phases.Limit();
  return d;
}

py::dict RenderTo(const Held& image, const Samples& out, int x0, int y0, const py::dict& options) {
  const ImageView view = ViewOf(out, x0, y0);
  const ImageSpec& spec = image.node.spec();
  if (view.channels != spec.channel_count()) {
    throw Error("out", "found " + std::to_string(view.channels) + " channels, expected the image's " +
                           std::to_string(spec.channel_count()));
  }
  if (!spec.data_window.Contains(view.roi))
    throw Error("region", "found pixels beyond the image's, expected a part of it");
  RunStats stats;
  Evaluate(options, [&](const RenderOptions& o) { RenderInto(image.node, view, o, &stats); });
  return DictOf(stats);
}

py::dict WriteTo(const Held& image, const std::string& file, const std::string& type,
                 const std::vector<std::array<std::string, 3>>& attributes, const py::dict& options) {
  RunStats stats;
  WriteOptions write;
  if (!type.empty()) write.type = TypeNamed(type);
  for (const auto& [name, text, kind] : attributes)
    write.attributes.push_back(ParseAttribute(name, text, kind));
  write.stats = &stats;
  Evaluate(options, [&](const RenderOptions& o) {
    write.render = o;
    Write(image.node, file, write);
  });
  return DictOf(stats);
}

py::dict VerifyIt(const Held& image, const std::string& type, int samples, int tile_size, double seconds,
                  const py::dict& options) {
  VerifyOptions verify;
  verify.samples = samples, verify.tile_size = tile_size, verify.seconds = seconds;
  const PixelType stored = TypeNamed(type);
  VerifyReport r;
  Evaluate(options, [&](const RenderOptions& o) {
    verify.render = o;
    r = Verify(image.node, stored, verify);
  });
  py::dict d;
  d["within_bound"] = r.within_bound, d["summary"] = r.Summary();
  d["max_error"] = r.max_error, d["rms_error"] = r.rms_error;
  d["bound"] = r.bound, d["largest_bound"] = r.largest_bound, d["closest"] = r.closest;
  d["samples"] = r.samples, d["share"] = r.share, d["undecided"] = r.undecided;
  d["nan_mismatches"] = r.nan_mismatches, d["out_of_bound"] = r.out_of_bound;
  d["codes_at_tie"] = r.codes_at_tie, d["codes_wrong"] = r.codes_wrong;
  d["worst"] = py::make_tuple(r.worst_x, r.worst_y, r.worst_channel), d["remarks"] = r.remarks;
  return d;
}

// Pixels of any values in memory that the engine keeps for the next picture: the system takes as long to
// clear a picture's pages as most graphs take to fill them.
Image PixelsOf(int width, int height, int channels, const std::string& type) {
  ImageSpec spec(0, 0, channels, TypeNamed(type));
  spec.data_window = spec.display_window = {0, 0, width, height};
  return Image::Uninitialized(std::move(spec));
}
py::buffer_info BufferOf(const Image& image) {
  constexpr const char* kFormats[] = {"B", "H", "e", "f"};
  const ImageView v = image.view();
  return {v.data,
          static_cast<py::ssize_t>(PixelBytes(v.type)),
          kFormats[static_cast<size_t>(v.type)],
          3,
          {py::ssize_t{v.roi.height()}, py::ssize_t{v.roi.width()}, py::ssize_t{v.channels}},
          {v.row_stride, v.pixel_stride, v.channel_stride}};
}

}  // namespace

void Evaluate(const py::dict& given, const std::function<void(const RenderOptions&)>& work) {
  RenderOptions options = OptionsOf(given);
  const py::object progress = given.contains("progress") ? py::object(given["progress"]) : py::none();
  if (progress.is_none() && !IsMainThread()) {  // signals are the main thread's
    const py::gil_scoped_release unlocked;
    work(options);
    return;
  }
  // Another thread computes, so that this one is there for signals whatever the work is at.
  Shared shared;
  options.progress = [&shared](double share) {
    shared.share = share;
    return !shared.stop;
  };
  std::optional<py::error_already_set> raised;
  bool stopped = false;
  {
    const py::gil_scoped_release unlocked;
    std::thread worker([&] {
      try {
        work(options);
      } catch (...) {
        shared.failure = std::current_exception();
      }
      const std::lock_guard lock(shared.mutex);
      shared.done = true;
      shared.changed.notify_one();
    });
    std::unique_lock lock(shared.mutex);
    while (!shared.changed.wait_for(lock, kLook, [&] { return shared.done; })) {
      lock.unlock();
      if (!shared.stop) {
        const py::gil_scoped_acquire locked;
        try {
          stopped = !Look(progress, shared.share);
        } catch (py::error_already_set& e) {
          raised.emplace(e);
        } catch (const py::cast_error&) {
          stopped = true;
        }
        if (stopped || raised) shared.stop = true;
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (raised) throw py::error_already_set(*raised);
  if (shared.failure) std::rethrow_exception(shared.failure);
  if (!Look(progress, 1)) throw Cancelled();
}

void AddEvaluation(py::module_& core) {
  py::class_<Image>(core, "Pixels", py::buffer_protocol()).def(py::init(&PixelsOf)).def_buffer(&BufferOf);
  core.def("render", &RenderTo);
  core.def("write", &WriteTo);
  core.def("verify", &VerifyIt);
  core.def("explain", [](const Held& image, const std::string& type, const py::dict& options) {
    const RenderOptions o = OptionsOf(options);
    const PixelType stored = TypeNamed(type);
    const py::gil_scoped_release unlocked;
    return Explain(image.node, stored, o);
  });
  core.def("cost", [](const Held& image, const std::string& type, const py::dict& options) {
    using namespace py::literals;  // NOLINT: names of a dict's keys
    const RenderOptions o = OptionsOf(options);
    const PixelType stored = TypeNamed(type);
    CostEstimate cost;
    {
      const py::gil_scoped_release unlocked;
      cost = EstimateCost(image.node, stored, o);
    }
    py::list parts;
    for (const CostEstimate::Part& p : cost.parts) {
      parts.append(
          py::dict("name"_a = p.name, "elapsed"_a = p.elapsed, "busy"_a = p.busy, "pass"_a = p.pass));
    }
    return py::dict("seconds"_a = cost.Seconds(), "limit"_a = cost.Limit(), "threads"_a = cost.threads,
                    "memory"_a = cost.memory, "pixels"_a = cost.pixels, "bytes"_a = cost.bytes,
                    "parts"_a = parts);
  });
  core.def("targets", &SimdTargets);
  core.def("target", &SimdTarget);
  core.def("set_target", &SetSimdTarget);
}

}  // namespace tessera::python
