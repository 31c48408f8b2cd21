// A reader's process: takes the first question, gives up all that it may do, and answers.
#include <signal.h>
#include <unistd.h>

#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/prctl.h>
#endif

#include "io/image_file.h"
#include "io/sandbox/message.h"
#include "io/sandbox/starter.h"
#include "io/spec.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::io::sandbox {
namespace {

constexpr double kForEver = std::numeric_limits<double>::infinity();

FileRequest TakeRequest(MessageReader& question) {
  FileRequest request;
  request.file = question.GetText();
  request.sparse = question.GetFlag();
  ReadOptions& o = request.options;
  o.subimage = question.Get<int>();
  o.part = question.GetText();
  o.codec = question.Get<Codec>(), o.formats = question.Get<Formats>();
  o.enough_width = question.Get<int>(), o.enough_height = question.Get<int>();
  Policy policy;
  policy.pixels = question.Get<int64_t>(), policy.channels = question.Get<int64_t>();
  policy.listed_formats = question.GetFlag();
  Context::Default().SetPolicy(policy);
  return request;
}

class Reader {
 public:
  explicit Reader(FileRequest request) : request_(std::move(request)) {}

  std::string Answer(Ask ask, MessageReader& question, std::vector<Descriptor>& descriptors) {
    MessageWriter answer;
    answer.Put(sandbox::Answer::kDone);
    switch (ask) {
      case Ask::kOpen: {
        const FileHeader& header = File().header();
        answer.PutText(header.format).PutSpec(header.spec).Put(header.subimage).Put(header.divisor);
        break;
      }
      case Ask::kNames: {
        const std::vector<std::string> names = PartNamesHere(request_.file, request_.options.formats);
        answer.Put<uint64_t>(names.size());
        for (const std::string& name : names) answer.PutText(name);
        break;
      }
      case Ask::kDecoder:
        answer.PutText(File().Decoder());
        break;
      case Ask::kRows: {
        first_ = question.Get<int>(), last_ = question.Get<int>();
        Map(question, descriptors);
        rows_ = File().Open(first_, last_);
        break;
      }
      case Ask::kLimit: {
        const auto threads = question.Get<int>();
        rows_->Limit(threads, question.Get<size_t>());
        break;
      }
      case Ask::kRead: {
        const auto top = question.Get<int>(), bottom = question.Get<int>();
        const OIIO::ImageSpec& spec = File().header().spec;
        rows_->Read(ImageView(memory_->data(), {spec.x, top, spec.x + spec.width, bottom}, last_ - first_,
                              StorageType(spec)));
        break;
      }
      case Ask::kSlices: {
        const auto first = question.Get<int>(), last = question.Get<int>();
        const auto type = question.Get<PixelType>();
        Map(question, descriptors);
        slices_ = File().OpenSlices(first, last, type);
        break;
      }
      case Ask::kSlice: {
        const auto front = question.Get<int>(), back = question.Get<int>();
        slices_->Read(front, back, memory_->data());
        break;
      }
    }
    return answer.bytes();
  }

 private:
  ImageFile& File() {
    if (!file_) file_ = OpenFileHere(request_);
    return *file_;
  }
  void Map(MessageReader& question, std::vector<Descriptor>& descriptors) {
    const auto size = question.Get<size_t>();
    if (question.Get<Shape>() != ShapeOf(File().header().spec))
      throw DataError(request_.file, "the file changed after its header was read");
    if (descriptors.size() != 1) throw std::bad_alloc();
    memory_.emplace(descriptors[0], size);
  }

  const FileRequest request_;
  std::unique_ptr<ImageFile> file_;
  std::optional<SharedMemory> memory_;
  int first_ = 0, last_ = 0;
  std::unique_ptr<graph::RowReader> rows_;
  std::unique_ptr<SliceReader> slices_;
};

std::string Failure(ErrorKind kind, const std::string& reason) {
  return MessageWriter().Put(Answer::kError).Put(kind).PutText(reason).bytes();
}

std::string AnswerOf(Reader& reader, const std::string& bytes, std::vector<Descriptor>& descriptors) try {
  MessageReader question(bytes);
  const auto ask = question.Get<Ask>();
  return reader.Answer(ask, question, descriptors);
} catch (const Error& e) {
  return Failure(KindOf(e), e.reason());
} catch (const std::bad_alloc&) {
  return MessageWriter().Put(Answer::kNoMemory).bytes();
} catch (const std::exception& e) {
  return Failure(ErrorKind::kData, OneLine(e.what()));
}

std::string NotConfined(const std::exception& e) {
  return Failure(ErrorKind::kSystem, std::string("its reader cannot be put in a sandbox: ") + e.what());
}

void Serve(int socket, int input, const ChildLimits& limits) {
#ifdef __linux__
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  try {
    KeepTwo(socket, input);
  } catch (const std::exception& e) {
    Channel{Descriptor(socket)}.Send(NotConfined(e));
    return;
  }
  Channel channel{Descriptor(socket)};
  std::string bytes;
  std::vector<Descriptor> descriptors;
  if (channel.Receive(bytes, kForEver) != Channel::Received::kMessage) return;
  MessageReader first(bytes);
  const FileRequest request = TakeRequest(first);
  try {
    Confine(request.file, input, limits);
  } catch (const std::exception& e) {
    channel.Send(NotConfined(e));
    return;
  }
  Reader reader(request);
  while (channel.Receive(bytes, kForEver, &descriptors) == Channel::Received::kMessage) {
    if (!channel.Send(AnswerOf(reader, bytes, descriptors))) break;
    descriptors.clear();
  }
  ::_exit(0);  // what has threads and open files is not taken down
}

}  // namespace

void RunChild(int socket, int input, const ChildLimits& limits) {
  try {
    Serve(socket, input, limits);
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

}  // namespace tessera::io::sandbox
