// Building nodes: validation, sources in memory.
#include <new>
#include <string>

#include "base/arena.h"
#include "graph/op.h"
#include "graph/source.h"
#include "tessera/error_kind.h"

namespace tessera {
namespace graph {
namespace {

std::string SizeText(const Roi& r) {
  std::string s = std::to_string(r.width()) + "x" + std::to_string(r.height());
  if (r.x0 != 0 || r.y0 != 0) {
    s += (r.x0 < 0 ? "" : "+") + std::to_string(r.x0) + (r.y0 < 0 ? "" : "+") + std::to_string(r.y0);
  }
  return s;
}

class MemorySource final : public PixelSource {
 public:
  MemorySource(const ConstImageView& view, ImageSpec spec, Image owner)
      : view_(view), spec_(std::move(spec)), owner_(std::move(owner)) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "memory"; }
  std::optional<ConstImageView> View() const override { return view_; }
  // Somebody's view may end with a page.
  ptrdiff_t ReadMargin() const override { return owner_.view().data == nullptr ? 0 : base::kReadMargin; }

 private:
  ConstImageView view_;
  ImageSpec spec_;
  Image owner_;
};

}  // namespace

NodeData::~NodeData() {
  std::vector<Node> orphans = std::move(inputs);
  while (!orphans.empty()) {
    const Node node = std::move(orphans.back());
    orphans.pop_back();
    if (node && node.shared().use_count() == 1) {
      // The last owner: nobody else can see the node, so its inputs may be taken.
      auto& theirs = const_cast<NodeData*>(node.data())->inputs;
      try {
        orphans.insert(orphans.end(), theirs.begin(), theirs.end());
        theirs.clear();
      } catch (const std::bad_alloc&) {  // released by recursion, then
      }
    }
  }
}

// An alpha among the three colours would be computed with them and passed on at once.
static void RequireAlphaApart(const std::string& op, const ImageSpec& image) {
  if (image.channel_count() < 3 || image.alpha < 0 || image.alpha > 2) return;
  throw DataError(
      op, "found the alpha channel " + image.channels[static_cast<size_t>(image.alpha)] +
              " among the first three channels, expected colours there; --ch reorders or renames them");
}

Node MakeNode(std::shared_ptr<const Op> op, std::vector<Node> inputs) {
  std::vector<ImageSpec> specs;
  specs.reserve(inputs.size());
  for (const Node& input : inputs) {
    if (!input) throw Error(op->Name(), "an operand is empty, expected an image");
    specs.push_back(input.spec());
  }
  if (op->Kind() == OpKind::kColor && !specs.empty()) RequireAlphaApart(op->Name(), specs[0]);
  ImageSpec spec = op->OutputSpec(specs);
  return Node(std::make_shared<const NodeData>(NodeData{std::move(op), std::move(inputs), std::move(spec)}));
}

Node MakeSource(std::shared_ptr<const PixelSource> source) {
  return MakeNode(std::make_shared<const SourceOp>(std::move(source)), {});
}

void RequireSameWindow(const std::string& op, std::span<const ImageSpec> inputs) {
  for (size_t k = 1; k < inputs.size(); ++k) {
    if (inputs[k].data_window != inputs[0].data_window) {
      throw DataError(op, "operands differ in size: " + SizeText(inputs[0].data_window) + " and " +
                              SizeText(inputs[k].data_window) + ", expected equal data windows");
    }
  }
}

void RequireColor(const std::string& op, const ImageSpec& input) {
  if (input.channel_count() >= 3) return;
  std::string names;
  for (const std::string& name : input.channels) names += (names.empty() ? "" : ",") + name;
  throw DataError(op, "found channels " + names + ", expected at least three (R,G,B)");
}

}  // namespace graph

const ImageSpec& Node::spec() const {
  if (data_ == nullptr) throw Error("node", "is empty, expected an image");
  return data_->spec;
}

Node FromImage(const Image& image) {
  return graph::MakeSource(
      std::make_shared<const graph::MemorySource>(ConstImageView(image.view()), image.spec(), image));
}

Node FromView(const ConstImageView& pixels, const ImageSpec& spec) {
  if (pixels.roi != spec.data_window || pixels.channels != spec.channel_count()) {
    throw Error("view", "covers " + graph::SizeText(pixels.roi) + " with " + std::to_string(pixels.channels) +
                            " channels, but its spec says " + graph::SizeText(spec.data_window) + " with " +
                            std::to_string(spec.channel_count()));
  }
  ImageSpec s = spec;
  s.type = pixels.type;
  return graph::MakeSource(std::make_shared<const graph::MemorySource>(pixels, std::move(s), Image()));
}

}  // namespace tessera
