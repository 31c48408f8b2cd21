// Items of metadata, and those of them that are an image's state.
#include "cli/metadata.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <cstring>

#include "tessera/color_state.h"
#include "tessera/metadata.h"
#include "tessera/ops/arrangement.h"

namespace tessera::cli {
namespace {

bool SameName(const std::string& a, const std::string& b) { return OIIO::Strutil::iequals(a, b); }

constexpr char kSpace[] = "oiio:ColorSpace", kUnassociated[] = "oiio:UnassociatedAlpha",
               kOrientation[] = "Orientation";

int IntOf(const Attribute& item) {
  int value = 0;
  if (item.type == "int" && item.bytes.size() == sizeof value)
    std::memcpy(&value, item.bytes.data(), sizeof value);
  return value;
}

}  // namespace

std::vector<Attribute> MetadataOf(const Entry& entry) {
  std::vector<Attribute> items;
  if (entry.node.spec().metadata) items = *entry.node.spec().metadata;
  for (const Attribute& own : entry.attributes) {
    const auto it = std::find_if(items.begin(), items.end(),
                                 [&](const Attribute& item) { return SameName(item.name, own.name); });
    const bool erases = own.bytes.empty() && own.strings.empty();
    if (it == items.end()) {
      if (!erases) items.push_back(own);
    } else if (erases) {
      items.erase(it);
    } else {
      *it = own;
    }
  }
  return items;
}

const Attribute* FindItem(const std::vector<Attribute>& items, const std::string& name) {
  const auto it = std::find_if(items.begin(), items.end(),
                               [&](const Attribute& item) { return SameName(item.name, name); });
  return it == items.end() ? nullptr : &*it;
}

std::string ItemText(const Entry& entry, const std::string& name) {
  const std::vector<Attribute> items = MetadataOf(entry);
  const Attribute* const item = FindItem(items, name);
  return item == nullptr ? "" : AttributeText(*item);
}

void SetItem(Entry& entry, Attribute item) {
  const ColorState color = ColorStateOf(entry.node.spec());
  if (item.name == kSpace && !item.strings.empty()) {
    entry.node = WithColorState(entry.node, {item.strings[0], color.premultiplied});
    return;
  }
  if (item.name == kUnassociated) {
    entry.node = WithColorState(entry.node, {color.space, AttributeText(item) == "0"});
    return;
  }
  if (const int orientation = IntOf(item);
      SameName(item.name, kOrientation) && orientation >= 1 && orientation <= 8) {
    entry.node = WithOrientation(entry.node, orientation);
    return;
  }
  std::erase_if(entry.attributes, [&](const Attribute& a) { return SameName(a.name, item.name); });
  entry.attributes.push_back(std::move(item));
}

void MergeMetadata(std::vector<Entry>& operands) {
  for (size_t k = 1; k < operands.size(); ++k) {
    const std::vector<Attribute> before = MetadataOf(operands[0]);
    for (const Attribute& item : MetadataOf(operands[k])) {
      if (FindItem(before, item.name) == nullptr) SetItem(operands[0], item);
    }
  }
}

void EraseItem(Entry& entry, const std::string& name) {
  const ColorState color = ColorStateOf(entry.node.spec());
  if (SameName(name, kSpace)) {
    entry.node = WithColorState(entry.node, {"", color.premultiplied});
  } else if (SameName(name, kUnassociated)) {
    entry.node = WithColorState(entry.node, {color.space, true});
  } else if (SameName(name, kOrientation)) {
    entry.node = WithOrientation(entry.node, 1);
  } else {
    std::erase_if(entry.attributes, [&](const Attribute& a) { return SameName(a.name, name); });
    entry.attributes.push_back({name, "string", {}, {}});
  }
}

}  // namespace tessera::cli
