// The program's side of files that are read in a sandbox. Whatever comes back is checked as a file is.
#include <algorithm>
#include <cstring>
#include <limits>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "base/input_file.h"
#include "io/image_file.h"
#include "io/open_input.h"
#include "io/sandbox/message.h"
#include "io/sandbox/starter.h"
#include "io/spec.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace sandbox {
namespace {

// Rows that are read at a time: what the caches hold, and enough for all of a codec's threads.
constexpr size_t kWindow = size_t{8} << 20;
constexpr size_t kMostIdle = 8;

// A process that has been asked to open the file.
class Conversation {
 public:
  explicit Conversation(const FileRequest& request)
      : file_(request.file), stream_(request.file, "an image file") {
    if (stream_.size() == 0) throw DataError(file_, "found an empty file (0 bytes), expected an image");
    const Policy policy = Context::Default().policy();
    memory_ = policy.reader_memory;
    child_ = StartChild(
        file_, stream_.descriptor(),
        {memory_, (policy.reader_seconds + 1) * std::max(1U, std::thread::hardware_concurrency())});
    const ReadOptions& o = request.options;
    MessageWriter first;
    first.PutText(file_).Put<uint8_t>(request.sparse).Put(o.subimage).PutText(o.part).Put(o.codec);
    first.Put(o.formats).Put(o.enough_width).Put(o.enough_height);
    first.Put(policy.pixels).Put(policy.channels).Put<uint8_t>(policy.listed_formats);
    child_->channel().Send(first.bytes());
  }

  int64_t file_bytes() const { return stream_.size(); }

  // The answer's bytes; what is wrong with it is thrown by `take`, and said of the file.
  template <typename Take>
  auto Tell(const MessageWriter& question, const Take& take, const std::vector<int>& descriptors = {}) {
    std::string bytes;
    child_->channel().Send(question.bytes(), descriptors);  // one that has ended may have said why
    const double seconds = Context::Default().policy().reader_seconds;
    switch (child_->channel().Receive(bytes, seconds)) {
      case Channel::Received::kEnd:
        Fail();
      case Channel::Received::kLate:
        throw SystemError(file_, "its reader has taken more than " + Short(seconds) + " s, and was ended");
      case Channel::Received::kMessage:
        break;
    }
    try {
      MessageReader answer(bytes);
      const auto what = answer.Get<Answer>();
      if (what == Answer::kDone) return take(answer);
      if (what == Answer::kError) {
        const auto kind = answer.Get<ErrorKind>();
        const std::string reason = answer.GetText().substr(0, 2000);
        if (kind == ErrorKind::kUsage) throw Error(file_, reason);
        if (kind == ErrorKind::kSystem) throw SystemError(file_, reason);
        throw DataError(file_, reason);
      }
    } catch (const Error&) {
      throw;
    } catch (const std::runtime_error& e) {
      throw DataError(file_, e.what());
    }
    throw SystemError(file_,
                      "its reader was refused memory; it may take " + std::to_string(memory_ >> 20) + " MiB");
  }
  void Tell(const MessageWriter& question, const std::vector<int>& descriptors = {}) {
    Tell(
        question, [](MessageReader&) {}, descriptors);
  }

 private:
  [[noreturn]] void Fail() { throw DataError(file_, "its reader " + child_->End()); }
  static std::string Short(double seconds) {
    std::string text = std::to_string(seconds);
    text.erase(text.find_last_not_of('0') + 1);
    return text.back() == '.' ? text.substr(0, text.size() - 1) : text;
  }

  std::string file_;
  base::InputFile stream_;
  int64_t memory_ = 0;
  std::unique_ptr<Child> child_;
};

// Processes that have opened a file and wait for its rows to be wanted. Of a line of a thousand files a few
// do; the others are opened again.
class Idle {
 public:
  void Put(const void* owner, std::unique_ptr<Conversation> conversation) {
    std::unique_ptr<Conversation> oldest;  // ended without the lock
    const std::lock_guard lock(mutex_);
    waiting_.emplace_back(owner, std::move(conversation));
    if (waiting_.size() <= kMostIdle) return;
    oldest = std::move(waiting_.front().second);
    waiting_.pop_front();
  }
  std::unique_ptr<Conversation> Take(const void* owner) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                    [owner](const auto& one) { return one.first == owner; });
    if (found == waiting_.end()) return nullptr;
    auto taken = std::move(found->second);
    waiting_.erase(found);
    return taken;
  }

 private:
  std::mutex mutex_;
  std::list<std::pair<const void*, std::unique_ptr<Conversation>>> waiting_;
};

// Never destroyed: pictures may outlive other globals.
Idle& TheIdle() {
  static auto* const kIdle = new Idle;
  return *kIdle;
}

class RowsApart final : public graph::RowReader {
 public:
  RowsApart(std::unique_ptr<Conversation> conversation, const FileHeader& header, int granularity, int first,
            int last)
      : conversation_(std::move(conversation)),
        channels_(last - first),
        type_(StorageType(header.spec)),
        row_(PixelBytes(type_) * static_cast<size_t>(channels_) * static_cast<size_t>(header.spec.width)),
        rows_(RowsAtOnce(header.spec, row_, granularity)),
        memory_(row_ * static_cast<size_t>(rows_)) {
    MessageWriter question;
    question.Put(Ask::kRows).Put(first).Put(last).Put(memory_.size());
    question.Put(ShapeOf(header.spec));
    conversation_->Tell(question, {memory_.descriptor()});
  }

  void Limit(int threads, size_t memory) override {
    MessageWriter question;
    question.Put(Ask::kLimit).Put(threads).Put(memory);
    conversation_->Tell(question);
  }

  void Read(const ImageView& out) override {
    for (int y = out.roi.y0; y < out.roi.y1;) {
      const int end = static_cast<int>(std::min<int64_t>(int64_t{y} + rows_, out.roi.y1));
      MessageWriter question;
      question.Put(Ask::kRead).Put(y).Put(end);
      conversation_->Tell(question);
      const std::byte* from = memory_.data();
      for (; y < end; ++y, from += row_) CopyRow(from, out.At(out.roi.x0, y), out.pixel_stride);
    }
  }

 private:
  // Whole chunks or rows of tiles.
  static int RowsAtOnce(const OIIO::ImageSpec& spec, size_t row, int granularity) {
    const size_t some = kWindow / (row * static_cast<size_t>(granularity));
    const auto rows = static_cast<int64_t>(std::max<size_t>(some, 1)) * granularity;
    return static_cast<int>(std::min<int64_t>(rows, spec.height));
  }
  void CopyRow(const std::byte* from, std::byte* to, ptrdiff_t stride) const {
    const size_t pixel = PixelBytes(type_) * static_cast<size_t>(channels_);
    if (stride == static_cast<ptrdiff_t>(pixel)) {
      std::memcpy(to, from, row_);
      return;
    }
    for (size_t at = 0; at < row_; at += pixel, to += stride) std::memcpy(to, from + at, pixel);
  }

  std::unique_ptr<Conversation> conversation_;
  int channels_;
  PixelType type_;
  size_t row_;  // bytes
  int rows_;
  SharedMemory memory_;
};

class SlicesApart final : public SliceReader {
 public:
  SlicesApart(std::unique_ptr<Conversation> conversation, const ImageFile& file, int first, int last,
              PixelType type)
      : conversation_(std::move(conversation)),
        slice_(static_cast<size_t>(file.header().spec.width) *
               static_cast<size_t>(file.header().spec.height) * PixelBytes(type) *
               static_cast<size_t>(last - first)),
        slices_(file.SlicesWithin(kWindow, slice_)),
        memory_(slice_ * static_cast<size_t>(slices_)) {
    MessageWriter question;
    question.Put(Ask::kSlices).Put(first).Put(last).Put(type).Put(memory_.size());
    question.Put(ShapeOf(file.header().spec));
    conversation_->Tell(question, {memory_.descriptor()});
  }

  void Read(int z0, int z1, std::byte* data) override {
    for (int z = z0; z < z1;) {
      const int end = static_cast<int>(std::min<int64_t>(int64_t{z} + slices_, z1));
      conversation_->Tell(MessageWriter().Put(Ask::kSlice).Put(z).Put(end));
      const size_t bytes = slice_ * static_cast<size_t>(end - z);
      std::memcpy(data, memory_.data(), bytes);
      data += bytes;
      z = end;
    }
  }

 private:
  std::unique_ptr<Conversation> conversation_;
  size_t slice_;  // bytes
  int slices_;
  SharedMemory memory_;
};

class FileApart final : public ImageFile {
 public:
  explicit FileApart(const FileRequest& request) : request_(request) {
    auto conversation = std::make_unique<Conversation>(request);
    header_ = conversation->Tell(MessageWriter().Put(Ask::kOpen), [](MessageReader& answer) {
      FileHeader header;
      header.format = answer.GetText(), header.spec = answer.GetSpec();
      header.subimage = answer.Get<int>(), header.divisor = answer.Get<int>();
      return header;
    });
    const OIIO::ImageSpec& spec = header_.spec;
    if (!request.sparse || header_.format != "openvdb") {
      CheckSpec(request.file, header_.format, spec, conversation->file_bytes());
    } else if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 ||
               double(spec.width) * spec.height * std::max(spec.depth, 1) > 1e15) {
      throw DataError(request.file, "found a grid without voxels, or with too many");
    }
    TheIdle().Put(this, std::move(conversation));
  }
  ~FileApart() override { TheIdle().Take(this); }

  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    const int tile = header_.spec.tile_height;
    return std::make_unique<RowsApart>(
        Take(), header_, tile > 0 ? tile : ChunkRows(header_.format, header_.spec), first, last);
  }
  std::string Decoder() const override {
    auto conversation = Take();
    std::string text = conversation->Tell(MessageWriter().Put(Ask::kDecoder),
                                          [](MessageReader& answer) { return answer.GetText(); });
    TheIdle().Put(this, std::move(conversation));
    return text + ", in a sandbox";
  }
  std::unique_ptr<SliceReader> OpenSlices(int first, int last, PixelType type) const override {
    return std::make_unique<SlicesApart>(Take(), *this, first, last, type);
  }

 private:
  std::unique_ptr<Conversation> Take() const {
    auto waiting = TheIdle().Take(this);
    return waiting ? std::move(waiting) : std::make_unique<Conversation>(request_);
  }

  FileRequest request_;
};

}  // namespace
}  // namespace sandbox

std::unique_ptr<ImageFile> OpenFileApart(const FileRequest& request) {
  return std::make_unique<sandbox::FileApart>(request);
}

std::vector<std::string> PartNamesApart(const std::string& file, Formats formats) {
  using sandbox::MessageReader;
  sandbox::Conversation conversation({file, {.formats = formats}});
  return conversation.Tell(sandbox::MessageWriter().Put(sandbox::Ask::kNames), [](MessageReader& answer) {
    std::vector<std::string> names(answer.GetCount(sizeof(uint64_t)));
    for (std::string& name : names) name = answer.GetText();
    return names;
  });
}

}  // namespace tessera::io
