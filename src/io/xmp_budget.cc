// As much of XML as tells elements, attributes and text apart, the way pugixml reads it; faults of the text
// are the reader's, which goes on with what came before them.
#include "io/xmp_budget.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>
#include <vector>

namespace tessera::io {
namespace {

using OIIO::Strutil::iequals;
using OIIO::Strutil::istarts_with;

constexpr int64_t kMostOfList = 64 << 10;

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

bool IsList(std::string_view element) {
  constexpr std::array<std::string_view, 4> kLists = {"rdf:Bag", "rdf:Seq", "rdf:Alt", "rdf:li"};
  return std::any_of(kLists.begin(), kLists.end(), [&](std::string_view l) { return iequals(element, l); });
}

}  // namespace

// One description, from its start tag on.
class XmpBudget::Scan {
 public:
  Scan(XmpBudget& budget, std::string_view text) : budget_(budget), text_(text) {}

  std::string Run() {
    while (why_.empty() && at_ < text_.size()) {
      if (text_[at_] != '<') {
        const size_t end = std::min(text_.find('<', at_), text_.size());
        Text(text_.substr(at_, end - at_));
        at_ = end;
      } else if (Skips("<!--", "-->") || Skips("<?", "?>")) {
      } else if (const size_t from = at_; Skips("<![CDATA[", "]]>")) {
        Text(text_.substr(from, at_ - from));
      } else if (text_.substr(at_).starts_with("</")) {
        if (!open_.empty()) open_.pop_back();
        at_ = After(">");
      } else {
        Tag();
      }
    }
    return why_;
  }

 private:
  struct Element {
    std::string_view parent;  // whose value its text is
    bool listed, left_out;
    int64_t list_from;  // what was joined before the outermost list began
  };

  size_t After(std::string_view mark) const {
    const size_t found = text_.find(mark, at_);
    return found == std::string_view::npos ? text_.size() : found + mark.size();
  }
  bool Skips(std::string_view start, std::string_view end) {
    if (!text_.substr(at_).starts_with(start)) return false;
    at_ += start.size();
    at_ = After(end);
    return true;
  }
  std::string_view Word() {
    const size_t from = at_;
    while (at_ < text_.size() && !IsSpace(text_[at_]) && text_[at_] != '=' && text_[at_] != '>' &&
           text_[at_] != '/') {
      ++at_;
    }
    return text_.substr(from, at_ - from);
  }
  void Space() {
    while (at_ < text_.size() && IsSpace(text_[at_])) ++at_;
  }

  void Tag() {
    ++at_;
    const std::string_view name = Word();
    Element e = open_.empty() ? Element{"", false, false, 0} : open_.back();
    while (why_.empty() && at_ < text_.size() && text_[at_] != '>') {
      Space();
      const std::string_view attribute = Word();
      Space();
      if (at_ < text_.size() && text_[at_] == '=') {
        ++at_;
        Space();
        if (at_ >= text_.size()) break;
        const char quote = text_[at_++];
        if (quote != '"' && quote != '\'') continue;
        const size_t end = std::min(text_.find(quote, at_), text_.size());
        if (!istarts_with(attribute, "xml:") && !istarts_with(attribute, "xmlns:"))
          Value(e, attribute, text_.substr(at_, end - at_));
        at_ = std::min(end + 1, text_.size());
      } else if (at_ < text_.size() && text_[at_] != '>' && attribute.empty()) {
        ++at_;  // "/", or what no tag holds
      }
    }
    const bool empty = text_[at_ - 1] == '/';
    at_ = std::min(at_ + 1, text_.size());
    if (empty) return;
    if (IsList(name)) {
      if (!e.listed) e.list_from = budget_.joined_;
      e.listed = true;
    } else {
      e.parent = name;
    }
    e.left_out |= iequals(name, "photoshop:DocumentAncestors");
    open_.push_back(e);
    if (open_.size() > kMostLevels) why_ = "found elements in more than 256 levels";
  }

  void Text(std::string_view text) {
    if (open_.empty() || std::all_of(text.begin(), text.end(), IsSpace)) return;
    Value(open_.back(), open_.back().parent, text);
  }

  void Value(const Element& e, std::string_view name, std::string_view value) {
    if (value.empty() || e.left_out) return;
    if (e.listed && budget_.joined_ - e.list_from > kMostOfList) return;
    auto held = budget_.held_.find(name);
    if (held == budget_.held_.end()) held = budget_.held_.emplace(name, 0).first;
    held->second += static_cast<int64_t>(value.size());
    budget_.joined_ += held->second;
    if (budget_.held_.size() > kMostNames) why_ = "found more than 4096 names of values";
    if (budget_.joined_ > kMostBytes) why_ = "found lists whose items take more than 256 MiB to join";
  }

  XmpBudget& budget_;
  std::string_view text_;
  size_t at_ = 0;
  std::vector<Element> open_;
  std::string why_;
};

std::string XmpBudget::Take(std::string_view packet) {
  constexpr std::string_view kStart = "<rdf:Description", kEnd = "</rdf:Description>";
  for (size_t end = 0;;) {
    const size_t start = packet.find(kStart, end);
    if (start == std::string_view::npos) return "";
    end = packet.find(kEnd, start);
    if (end == std::string_view::npos) return "";
    end += kEnd.size();
    if (std::string why = Scan(*this, packet.substr(start, end - start)).Run(); !why.empty()) return why;
  }
}

}  // namespace tessera::io
