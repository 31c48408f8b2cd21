// The two contestants that are always there: this library and the copy.
#include "contestant.h"

#include <algorithm>

#include "copy.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "workers.h"

namespace tessera::bench {
namespace {

class Tessera final : public Contestant {
 public:
  Tessera(const Setting& setting, std::string target, bool optimize)
      : target_(std::move(target)), optimize_(optimize), out_(setting.frame.output.view()) {
    options_.threads = setting.threads;
    options_.optimize = optimize;
    std::vector<Node> inputs;
    for (const Image& image : setting.frame.inputs) inputs.push_back(FromImage(image));
    node_ = setting.task.Build(inputs, setting.frame.output.spec());
  }

  std::string Name() const override { return "tessera " + target_ + (optimize_ ? "" : " unfolded"); }
  void Prepare() override { SetSimdTarget(target_); }
  void Run() override { RenderInto(node_, out_, options_); }

 private:
  std::string target_;
  bool optimize_;
  ImageView out_;
  RenderOptions options_;
  Node node_;
};

class Copy final : public Contestant {
 public:
  Copy(const Setting& setting, bool streaming)
      : streaming_(streaming), to_(setting.frame.output), workers_(setting.threads) {
    const ImageSpec rgba(setting.frame.width, setting.frame.height, 4, setting.frame.type);
    from_ = setting.frame.inputs.empty() ? Image(rgba) : setting.frame.inputs[0];
    if (!setting.frame.plain()) to_ = Image(rgba);
    bytes_ = static_cast<size_t>(setting.frame.pixels()) * 4 * PixelBytes(setting.frame.type);
    // Written once, so that no contestant pays for the first touch of a page.
    if (setting.frame.inputs.empty()) std::fill_n(from_.view().data, bytes_, std::byte{1});
    if (!setting.frame.plain()) std::fill_n(to_.view().data, bytes_, std::byte{1});
  }

  std::string Name() const override { return streaming_ ? "copy streaming" : "copy memcpy"; }
  bool IsCopy() const override { return true; }
  void Run() override {
    workers_.Run([this](int i) {
      const size_t count = static_cast<size_t>(workers_.count()), index = static_cast<size_t>(i);
      const size_t first = bytes_ * index / count / 64 * 64;
      const size_t last = index + 1 == count ? bytes_ : bytes_ * (index + 1) / count / 64 * 64;
      const auto copy = streaming_ ? CopyStreaming : CopyPlain;
      copy(from_.view().data + first, to_.view().data + first, last - first);
    });
  }

 private:
  bool streaming_;
  Image from_, to_;
  size_t bytes_ = 0;
  Workers workers_;
};

}  // namespace

std::unique_ptr<Contestant> MakeTessera(const Setting& setting, const std::string& target, bool optimize) {
  return std::make_unique<Tessera>(setting, target, optimize);
}

std::unique_ptr<Contestant> MakeCopy(const Setting& setting, bool streaming) {
  return std::make_unique<Copy>(setting, streaming);
}

}  // namespace tessera::bench
