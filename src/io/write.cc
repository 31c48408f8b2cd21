// Evaluation into files: a sink over a temporary file, renamed when everything has arrived.
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "graph/render.h"
#include "io/commit.h"
#include "io/file_sink.h"
#include "io/output_file.h"
#include "io/read_back.h"
#include "sched/scheduler.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"

namespace tessera {
namespace {

// Adds to the phases, where they are asked for, what stands around an evaluation: opening it and its plan,
// closing the file. One thread does that.
class FileTimes {
 public:
  FileTimes(RunStats* stats, int threads)
      : phases_(stats != nullptr ? &stats->phases : nullptr), threads_(sched::ThreadCount(threads)) {
    if (phases_ != nullptr) phases_->threads = threads_, known_ = phases_->seconds;
    last_ = Now();
  }
  // The graph has been evaluated.
  void Evaluated() {
    if (phases_ == nullptr) return;
    const double took = Lap();
    Alone(phases_->prepare, took - (phases_->seconds - known_));
    known_ = phases_->seconds;
  }
  // The file has been closed.
  void Closed() {
    if (phases_ == nullptr) return;
    const double took = Lap();
    Alone(phases_->encode, took);
    phases_->encode_elapsed += took;
    known_ = phases_->seconds;
  }

 private:
  using Time = std::chrono::steady_clock::time_point;
  Time Now() const { return phases_ != nullptr ? std::chrono::steady_clock::now() : Time(); }
  double Lap() {
    const std::chrono::duration<double> took = Now() - last_;
    last_ = Now();
    return took.count();
  }
  void Alone(double& phase, double took) {
    phase += took;
    phases_->wait += (threads_ - 1) * took;
    phases_->seconds += took;
  }

  RunPhases* const phases_;
  const int threads_;
  Time last_;
  double known_ = 0;  // seconds that have a phase
};

}  // namespace

PendingOutput::PendingOutput(const std::string& file, bool sync) : file_(file), sync_(sync) {}

PendingOutput::PendingOutput(const Node& node, const std::string& file, const WriteOptions& options)
    : PendingOutput(file, options.sync) {
  FileTimes times(options.stats, options.render.threads);
  const ImageSpec& spec = node.spec();
  const std::string target = io::ResolveTarget(file);
  io::FileSink sink(file, spec, options.type.value_or(spec.type), options.attributes);
  temporary_ = io::CreateTemporary(target, file);
  sink.Open(temporary_, options.codec, sched::ThreadCount(options.render.threads));
  type_ = sink.type();
  graph::RenderToSink(node, type_, sink, options.render, options.stats);
  times.Evaluated();
  sink.Finish();
  times.Closed();
  if (options.stats != nullptr) options.stats->files.push_back(file + " encoded by " + sink.encoder());
  read_back_ = [node, render = options.render, spec = sink.Layout()](int) {
    return io::ReadBack(spec, node, render);
  };
}

PendingOutput::PendingOutput(const std::vector<Part>& parts, const std::string& file,
                             const WriteOptions& options)
    : PendingOutput(file, options.sync) {
  FileTimes times(options.stats, options.render.threads);
  const std::string target = io::ResolveTarget(file);
  std::vector<std::unique_ptr<io::FileSink>> sinks;
  std::vector<io::FileSink*> all;
  for (const Part& part : parts) {
    const ImageSpec& spec = part.node.spec();
    sinks.push_back(
        std::make_unique<io::FileSink>(file, spec, part.type.value_or(spec.type), part.attributes));
    all.push_back(sinks.back().get());
  }
  if (all.empty() || !all[0]->HoldsSeveral()) {
    throw DataError(file, "found " + std::to_string(parts.size()) + " images, expected one for " +
                              (all.empty() ? "a file" : all[0]->Format()));
  }
  temporary_ = io::CreateTemporary(target, file);
  for (size_t i = 0; i < all.size(); ++i) {
    if (i == 0) {
      all[i]->OpenFirst(temporary_, all);
    } else {
      all[i]->OpenBehind(*all[i - 1]);
    }
    graph::RenderToSink(parts[i].node, all[i]->type(), *all[i], options.render, options.stats);
    times.Evaluated();
    all[i]->Finish();
    times.Closed();
  }
  type_ = all[0]->type();
  if (options.stats != nullptr) options.stats->files.push_back(file + " encoded by " + all[0]->encoder());
  std::vector<io::FileLayout> layouts;
  for (const io::FileSink* sink : all) layouts.push_back(sink->Layout());
  read_back_ = [parts, layouts, render = options.render](int part) {
    const auto at = static_cast<size_t>(part);
    return io::ReadBack(layouts.at(at), parts.at(at).node, render);
  };
}

PendingOutput::PendingOutput(const std::string& file, const std::vector<std::byte>& bytes, bool sync)
    : PendingOutput(file, sync) {
  temporary_ = io::CreateTemporary(io::ResolveTarget(file), file);
  io::CheckedFile stream(temporary_);
  stream.write(bytes.data(), bytes.size());
  stream.close();
  if (stream.failure() == 0) return;
  throw SystemError(
      file, "cannot be written: " + std::error_code(stream.failure(), std::generic_category()).message());
}

PendingOutput::PendingOutput(PendingOutput&& other) noexcept
    : read_back_(std::move(other.read_back_)),
      temporary_(std::exchange(other.temporary_, {})),
      file_(std::move(other.file_)),
      sync_(other.sync_),
      type_(other.type_) {}

StoredPixels PendingOutput::ReadBack(int part) const { return read_back_(part); }

PendingOutput::~PendingOutput() { io::RemoveTemporary(temporary_); }

void PendingOutput::Commit() { CommitTogether({this}); }

void PendingOutput::CommitTogether(const std::vector<PendingOutput*>& outputs, const Look& look) {
  std::vector<io::Finished> files;
  for (const PendingOutput* output : outputs) {
    if (!output->temporary_.empty()) files.push_back({output->temporary_, output->file_, output->sync_});
  }
  io::CommitAll(files, look);
  for (PendingOutput* output : outputs) output->temporary_.clear();
}

PixelType StoredType(const Node& node, const std::string& file, const WriteOptions& options) {
  const ImageSpec& spec = node.spec();
  PixelType type = spec.type;
  const std::string target = io::ResolveTarget(file);
  std::string temporary;
  try {
    // Some formats write when they are closed: the sink goes first.
    const PixelType asked = options.type.value_or(spec.type);
    io::FileSink judge(file, spec, asked, options.attributes);
    if (const auto only = judge.OnlyType()) {
      io::RequireDirectory(target, file);
      return *only;
    }
    // The type does not hang on the size, and closing an unfinished file may fill it up (JPEG).
    ImageSpec small = spec;
    small.data_window = small.display_window = {0, 0, 16, 16};
    io::FileSink sink(file, small, asked, options.attributes);
    temporary = io::CreateTemporary(target, file);
    sink.Open(temporary);
    type = sink.type();
  } catch (...) {
    io::RemoveTemporary(temporary);
    throw;
  }
  io::RemoveTemporary(temporary);
  return type;
}

bool HoldsParts(const std::string& file) {
  const auto output = OIIO::ImageOutput::create(file);
  if (!output) OIIO::geterror();
  return output && output->supports("multiimage");
}

void Write(const Node& node, const std::string& file, const WriteOptions& options) {
  PendingOutput(node, file, options).Commit();
}

}  // namespace tessera
