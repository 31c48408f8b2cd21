// Frames between pipes and graphs. What is subsampled goes through planes of floats; of all else the bytes
// are the image.
#include "cli/frame_stream.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iostream>
#include <system_error>

#include "base/policy.h"
#include "cli/batch_streams.h"
#include "cli/frame_files.h"
#include "cli/messages.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"

namespace tessera::cli {
namespace {

using io::PixelFormat;
using io::Samples;

constexpr char kInput[] = "standard input", kOutput[] = "standard output";
constexpr size_t kLongestHeader = 4096;

// Of std::cout, whose place is taken by frames.
class ToMessages : public std::streambuf {
 protected:
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    return static_cast<std::streamsize>(std::fwrite(text, 1, static_cast<size_t>(count), Messages()));
  }
  int overflow(int c) override { return c == EOF ? 0 : std::fputc(c, Messages()); }
};

[[noreturn]] void Fail(const char* subject, const std::string& what) {
  throw SystemError(subject, what + ": " + std::error_code(errno, std::generic_category()).message());
}

std::string Listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// A raw format, or C and a colour space of Y4M; whether it is Y4M.
bool SetFormat(const char* key, const std::string& word, io::Y4mHeader& header) {
  if (word.starts_with('C') && io::SetY4mColors(word.substr(1), header)) return true;
  header.pixels = io::FindPixelFormat(word);
  header.siting = io::Siting::kLeft;
  if (header.pixels != nullptr) return false;
  std::vector<std::string> raw;
  for (const PixelFormat& f : io::PixelFormats()) raw.push_back(f.name);
  throw UsageError(
      "--stream", std::string("found ") + key + "=" + word + ", expected y4m, C and a colour space of Y4M (" +
                      Listed(io::Y4mColorWords()) + ") or a format of raw frames (" + Listed(raw) + ")");
}

void SetSize(const std::string& text, io::Y4mHeader& header) {
  char rest = 0;
  constexpr int kMost = 65535;
  const int found = std::sscanf(text.c_str(), "%dx%d%c", &header.width, &header.height, &rest);
  const auto fits = [&](int side) { return side >= 1 && side <= kMost; };
  if (found != 2 || !fits(header.width) || !fits(header.height))
    throw UsageError("--stream", "found size=" + text + ", expected WxH with sides from 1 to " +
                                     std::to_string(kMost) + ", such as 1920x1080, for raw frames");
}

std::string RateOf(const std::string& text) {
  int over = 0, under = 1;
  char rest = 0;
  const int found = std::sscanf(text.c_str(), "%d/%d%c", &over, &under, &rest);
  const bool whole = text.find_first_not_of("0123456789") == std::string::npos;
  if ((found != 2 && !whole) || found < 1 || over < 1 || under < 1)
    throw UsageError("--stream",
                     "found rate=" + text + ", expected frames a second, such as 24 or 30000/1001");
  return std::to_string(over) + ":" + std::to_string(under);
}

void SetSiting(const std::string& word, io::Y4mHeader& header) {
  if (word == "centre") header.siting = io::Siting::kCentre;
  if (word == "left") header.siting = io::Siting::kLeft;
  if (word == "topleft") header.siting = io::Siting::kTopLeft;
}

// In [0, 1], of codes of fewer bits than their type has.
std::vector<double> Scale(const PixelFormat& f, bool up) {
  const double top = f.Top() / 65535.0;
  std::vector<double> scale(f.order.size(), up ? 1 / top : top);
  return scale;
}

bool HasSpareBits(const PixelFormat& f) { return f.type == PixelType::kUint16 && f.bits < 16; }

// What codes are divided by to be samples of the image: nothing where they are planes of floats.
double TopOf(const PixelFormat& f) {
  return f.IsSubsampled() ? 1 : f.type == PixelType::kUint8 ? 255 : 65535;
}

ImageSpec SpecOf(const PixelFormat& f, int width, int height) {
  ImageSpec spec(width, height, static_cast<int>(f.order.size()),
                 f.IsSubsampled() ? PixelType::kFloat : f.type);
  spec.channels = io::ChannelNames(f);
  spec.alpha = spec.ChannelIndex("A");
  return spec;
}

FrameMemory PlanesFor(int width, int height) {
  return FrameMemory(3 * sizeof(float) * static_cast<size_t>(width) * static_cast<size_t>(height));
}
float* Floats(const FrameMemory& memory) { return reinterpret_cast<float*>(memory.data()); }

ImageView PlanesView(int width, int height, float* planes) {
  constexpr ptrdiff_t kSample = sizeof(float);
  return {reinterpret_cast<std::byte*>(planes),
          Roi{0, 0, width, height},
          3,
          PixelType::kFloat,
          kSample * width * height,
          kSample,
          kSample * width};
}

[[noreturn]] void Refuse(const std::string& found, const std::string& expected) {
  throw UsageError("--stream", "found " + found + ", expected " + expected);
}

void RequireStreamable(const Options& o, bool reads, bool writes) {
  if (!reads && !writes)
    Refuse("neither - nor -o -", "a line that reads frames (-) or writes them (-o -), or both");
  if (reads && !o.frames.empty()) Refuse("--frames beside -", "the frames of standard input alone");
  if (reads && o.TellsInputs()) Refuse("--info or its like beside -", "it of files alone");
  if (writes && o.verify) Refuse("--verify beside -o -", "it of files, which can be read back");
  for (const auto& [given, name] :
       {std::pair{o.safe, "--safe"}, {o.resume, "--resume"}, {!o.part.empty(), "--part"}}) {
    if (given) Refuse(name, "a line without it");
  }
}

// What is read at once; 0 at the end.
size_t ReadSome(std::byte* to, size_t count) {
  while (true) {
    const ssize_t n = ::read(STDIN_FILENO, to, count);
    if (n >= 0) return static_cast<size_t>(n);
    if (!Again(STDIN_FILENO, POLLIN)) Fail(kInput, "cannot be read");
  }
}

// Of a pipe: fewer turns between the programs at its ends.
void Widen(int descriptor) {
  constexpr int kBytes = 1 << 20;  // what anybody may ask for
  ::fcntl(descriptor, F_SETPIPE_SZ, kBytes);
}

}  // namespace

bool ReadsStandardInput(const Step& step) {
  return step.deferred.empty() && step.command->info.name == "i" && step.arguments.Text("FILE") == "-";
}

FrameStream::FrameStream(const Line& line) : options_(line.options.stream) {
  for (const Step& step : line.steps) {
    reads_ = reads_ || ReadsStandardInput(step);
    writes_ = writes_ || (IsOutput(step) && step.deferred.empty() && step.arguments.Text("FILE") == "-");
  }
  RequireStreamable(line.options, reads_, writes_);
  ChooseFormats();
  if (reads_) Widen(STDIN_FILENO);
  if (!writes_) return;
  output_file_ = Take(STDOUT_FILENO, kOutput, O_WRONLY);
  Widen(output_file_);
  static auto* const messages = new ToMessages;  // std::cout is flushed after everything else has ended
  std::cout.rdbuf(messages);
  ::signal(SIGPIPE, SIG_IGN);  // who reads may go at any time, which is told
}

void FrameStream::ChooseFormats() {
  const StreamOptions& s = options_;
  y4m_in_ = s.input == "y4m";
  if (!y4m_in_) {
    if (SetFormat("input", s.input, in_)) Refuse("input=" + s.input, "y4m, whose header says which");
    SetSize(s.size, in_);
    SetSiting(s.siting, in_);
  } else if (!s.size.empty()) {
    Refuse("size=" + s.size, "it beside input=FORMAT, for raw frames");
  }
  y4m_out_ = y4m_in_;
  if (s.output != "same") {
    given_.emplace();
    io::SetY4mColors("444", *given_);
    y4m_out_ = s.output == "y4m" || SetFormat("output", s.output, *given_);
    SetSiting(s.siting, *given_);
    if (s.output == "y4m" && reads_ && y4m_in_) given_.reset();
    const bool raw = s.output == "y4m" && reads_ && !y4m_in_;
    if (raw && in_.pixels->samples != Samples::kRgb && !in_.pixels->HasAlpha() && !in_.pixels->IsFloat())
      given_->pixels = in_.pixels, given_->siting = in_.siting;
  } else if (!reads_) {
    y4m_out_ = true;
    io::SetY4mColors("444", given_.emplace());
  }
  if (!s.rate.empty()) {
    const std::string rate = RateOf(s.rate);
    if (given_) given_->rate = rate;
    in_.rate = rate;
  }
}

FrameStream::~FrameStream() {
  if (output_file_ >= 0) ::close(output_file_);
}

bool FrameStream::Read(std::byte* to, size_t count) {
  for (size_t done = 0; done < count;) {
    if (used_ < held_.size()) {
      const size_t n = std::min(count - done, held_.size() - used_);
      std::memcpy(to + done, held_.data() + used_, n);
      used_ += n, done += n;
      continue;
    }
    const size_t n = ReadSome(to + done, count - done);
    if (n > 0) {
      done += n;
      continue;
    }
    if (done == 0) return false;
    throw DataError(kInput, "found the end after " + std::to_string(done) + " of the " +
                                std::to_string(count) + " bytes of frame " +
                                std::to_string(frames_read_ + 1) + ", expected a whole one");
  }
  return true;
}

std::string FrameStream::ReadLine(const char* what, bool& ended) {
  std::string line;
  ended = false;
  while (true) {
    if (used_ == held_.size()) {
      held_.resize(kLongestHeader), used_ = 0;
      held_.resize(ReadSome(held_.data(), held_.size()));
      if (held_.empty()) {
        ended = true;
        return line;
      }
    }
    const char c = static_cast<char>(held_[used_++]);
    if (c == '\n') return line;
    line += c;
    if (line.size() > kLongestHeader)
      throw DataError(kInput, std::string("found no end of ") + what + " within " +
                                  std::to_string(kLongestHeader) + " bytes, expected a Y4M stream");
  }
}

void FrameStream::ReadHeader() {
  if (y4m_in_) {
    bool ended = false;
    const std::string line = ReadLine("the header", ended);
    if (ended && line.empty()) throw DataError(kInput, "found nothing, expected a stream of frames");
    const std::string rate = in_.rate;
    in_ = io::ParseY4mHeader(kInput, line);
    if (!options_.rate.empty()) in_.rate = rate;
    SetSiting(options_.siting, in_);
    const char fields = in_.interlacing.empty() ? 'p' : in_.interlacing[0];
    if (in_.pixels->half_height && (fields == 't' || fields == 'b' || fields == 'm'))
      throw DataError(kInput, "found interlaced frames of 4:2:0 (I" + in_.interlacing +
                                  "), whose fields have rows of chroma of their own, expected progressive "
                                  "ones, as ffmpeg -vf yadif makes them");
  }
  if (given_) {
    if (options_.rate.empty()) given_->rate = in_.rate;
    given_->aspect = in_.aspect, given_->interlacing = in_.interlacing;
    given_->full = in_.full;
  }
  base::RequireAllowed(kInput, {in_.width, in_.height, 1}, static_cast<int64_t>(in_.pixels->order.size()));
}

std::optional<StreamFrame> FrameStream::Next() {
  if (frames_read_ == 0) ReadHeader();
  bool ended = false;
  std::string marker = y4m_in_ ? ReadLine("a frame's header", ended) : "";
  StreamFrame frame{in_.width, in_.height, {}};
  if (!marker.empty() || (y4m_in_ && !ended)) {
    const std::string word = marker.substr(0, marker.find(' '));
    if (word == io::kY4mMagic)
      throw DataError(kInput, "found another header (" + Printable(marker) + ") after frame " +
                                  std::to_string(frames_read_) + ", expected frames of one size");
    if (word != io::kY4mFrame)
      throw DataError(kInput, "found no " + std::string(io::kY4mFrame) + " where frame " +
                                  std::to_string(frames_read_ + 1) +
                                  " is to begin, expected it there: a header that does not suit its frames?");
  }
  if (!ended) {
    frame.bytes = FrameMemory(io::FrameBytes(*in_.pixels, in_.width, in_.height));
    ended = !Read(frame.bytes.data(), frame.bytes.size());
    if (ended && y4m_in_)
      throw DataError(kInput, "found the end behind the header of frame " + std::to_string(frames_read_ + 1) +
                                  ", expected " + std::to_string(frame.bytes.size()) + " bytes");
  }
  if (!ended) {
    ++frames_read_;
    return frame;
  }
  if (frames_read_ == 0) throw DataError(kInput, "found no frame, expected one at least");
  return std::nullopt;
}

io::YccCoding FrameStream::Coding(const io::Y4mHeader& header, int width, int height) const {
  const bool grey = header.pixels->samples == Samples::kGrey;
  io::YccCoding coding;
  coding.bits = header.pixels->bits;
  coding.full = header.full.value_or(grey);
  if (options_.range != "auto") coding.full = options_.range == "full";
  if (grey && header.pixels->HasAlpha()) coding.full = true;
  const bool high = width >= 1280 || height >= 720;
  const std::string matrix = options_.matrix != "auto" ? options_.matrix : high ? "bt709" : "bt601";
  if (matrix == "bt709") coding.red = 0.2126, coding.blue = 0.0722;
  if (matrix == "bt2020") coding.red = 0.2627, coding.blue = 0.0593;
  return coding;
}

Entry FrameStream::ImageOf(StreamFrame& frame) const {
  const PixelFormat& f = *in_.pixels;
  const ImageSpec spec = SpecOf(f, frame.width, frame.height);
  if (f.IsSubsampled() && frame.planes.size() == 0) {
    frame.planes = PlanesFor(frame.width, frame.height);
    io::PlanesOfFrame(f, in_.siting, frame.width, frame.height, frame.bytes.data(), Floats(frame.planes));
  }
  Node node = FromView(f.IsSubsampled() ? PlanesView(frame.width, frame.height, Floats(frame.planes))
                                        : io::FrameView(f, frame.width, frame.height, frame.bytes.data()),
                       spec);
  const io::YccCoding coding = Coding(in_, frame.width, frame.height);
  if (f.samples == Samples::kYcc) {
    node = RenameChannels(ColorMatrix(node, {io::RgbOfYcc(coding, TopOf(f))}), {"R", "G", "B"});
  } else {
    if (HasSpareBits(f) && (f.samples != Samples::kGrey || coding.full))
      node = MulConstant(node, Scale(f, true));
    if (f.samples == Samples::kGrey && !coding.full && !f.IsFloat()) {
      double black = 0, white = 1;
      io::GreyCodes(coding, TopOf(f), black, white);
      node = MulConstant(AddConstant(node, {-black}), {1 / white});
    }
    const bool alpha = f.HasAlpha();
    if (f.samples == Samples::kRgb) node = SelectChannels(node, alpha ? "R,G,B,A" : "R,G,B");
    if (alpha && options_.alpha == "straight") node = Premultiply(node);
  }
  Entry entry{node, "-", {}};
  entry.suggested = f.IsFloat() ? f.type : f.bits > 8 ? PixelType::kUint16 : PixelType::kUint8;
  return entry;
}

Node FrameStream::SamplesOf(const Node& image) const {
  const io::Y4mHeader& header = output();
  const PixelFormat& f = *header.pixels;
  const ImageSpec& spec = image.spec();
  const int found = spec.channel_count() - (spec.alpha >= 0 ? 1 : 0);
  const int colors = f.samples == Samples::kGrey ? 1 : 3;
  if (found != colors) {
    throw DataError(std::string("-o - (") + f.name + ")",
                    "found the channels " + Listed(spec.channels) + ", expected " +
                        (colors == 1 ? "one, as --luminance --ch R makes" : "three, R, G and B") +
                        ", beside alpha; --stream:output= names another format, --ch chooses channels");
  }
  Node node = image;
  if (spec.alpha >= 0 && f.HasAlpha() && options_.alpha == "straight") node = Unpremultiply(node);
  std::vector<ChannelChoice> choices;
  int color = 0;
  std::vector<int> places;  // of the colours
  for (int c = 0; c < spec.channel_count(); ++c) {
    if (c != spec.alpha) places.push_back(c);
  }
  for (const std::string& name : io::ChannelNames(f)) {
    int place = 0;
    float value = 0;
    if (name == "A") {
      place = spec.alpha, value = 1;
    } else if (f.samples == Samples::kRgb) {
      place = places[name == "R" ? 0 : name == "G" ? 1 : 2];
    } else {
      place = places[static_cast<size_t>(color++)];
    }
    choices.push_back({place, value, name});
  }
  if (f.samples == Samples::kYcc) choices[0].name = "R", choices[1].name = "G", choices[2].name = "B";
  node = SelectChannels(node, choices);
  const io::YccCoding coding =
      reads_ ? Coding(header, in_.width, in_.height) : Coding(header, spec.width(), spec.height());
  if (f.samples == Samples::kYcc) {
    node = ColorMatrix(node, {io::YccOfRgb(coding, TopOf(f))});
  } else if (f.samples == Samples::kGrey && !coding.full && !f.IsFloat()) {
    double black = 0, white = 1;
    io::GreyCodes(coding, TopOf(f), black, white);
    node = AddConstant(MulConstant(node, {white}), {black});
  } else if (HasSpareBits(f)) {
    node = MulConstant(node, Scale(f, false));
  }
  if (HasSpareBits(f) && !f.IsSubsampled()) {
    const std::vector<double> top = Scale(f, false);
    node = Clamp(node, {std::vector<double>(top.size(), 0), top});
  }
  return node;
}

StreamFrame FrameStream::FrameOf(const Node& samples, const RenderOptions& render, RunStats* stats) const {
  const io::Y4mHeader& header = output();
  const PixelFormat& f = *header.pixels;
  const Roi window = samples.spec().data_window;
  StreamFrame frame{window.width(), window.height(), {}};
  frame.bytes = FrameMemory(io::FrameBytes(f, frame.width, frame.height));
  const auto evaluate = [&](ImageView view) {
    view.roi = window;
    RenderInto(samples, view, render, stats);
  };
  if (!f.IsSubsampled()) {
    evaluate(io::FrameView(f, frame.width, frame.height, frame.bytes.data()));
    return frame;
  }
  const FrameMemory planes = PlanesFor(frame.width, frame.height);
  evaluate(PlanesView(frame.width, frame.height, Floats(planes)));
  io::FrameOfPlanes(f, header.siting, frame.width, frame.height, Floats(planes), frame.bytes.data());
  return frame;
}

void FrameStream::Write(const StreamFrame& frame) {
  const auto write = [&](const void* bytes, size_t count) {
    for (size_t done = 0; done < count;) {
      const ssize_t n = ::write(output_file_, static_cast<const std::byte*>(bytes) + done, count - done);
      if (n >= 0) {
        done += static_cast<size_t>(n);
      } else if (errno == EPIPE) {
        throw SystemError(kOutput, "nobody reads it any more (frame " + std::to_string(frames_written_ + 1) +
                                       "): what is behind the pipe has ended");
      } else if (!Again(output_file_, POLLOUT)) {
        Fail(kOutput, "cannot be written");
      }
    }
  };
  if (frames_written_ == 0) {
    first_width_ = frame.width, first_height_ = frame.height;
    io::Y4mHeader header = output();
    header.width = frame.width, header.height = frame.height;
    if (header.pixels->samples != Samples::kRgb) header.full = Coding(header, frame.width, frame.height).full;
    const std::string line = io::Y4mLine(header);
    if (y4m_out_) write(line.data(), line.size());
  }
  if (frame.width != first_width_ || frame.height != first_height_) {
    throw DataError(kOutput, "found a result of " + std::to_string(frame.width) + " x " +
                                 std::to_string(frame.height) + " pixels as frame " +
                                 std::to_string(frames_written_ + 1) + ", expected " +
                                 std::to_string(first_width_) + " x " + std::to_string(first_height_) +
                                 " as of the first");
  }
  const std::string marker = std::string(io::kY4mFrame) + "\n";
  if (y4m_out_) write(marker.data(), marker.size());
  write(frame.bytes.data(), frame.bytes.size());
  ++frames_written_;
}

}  // namespace tessera::cli
