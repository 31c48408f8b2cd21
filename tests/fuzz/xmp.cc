// XMP that passes the look at it is read by OpenImageIO, of no more values than are allowed.
#include <OpenImageIO/tiffutils.h>

#include "fuzz/fuzz.h"
#include "io/xmp_budget.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {
      "<x:xmpmeta><rdf:RDF><rdf:Description rdf:about='' tiff:Make=\"M\" xmp:Rating='3'><dc:subject>"
      "<rdf:Bag><rdf:li>one</rdf:li><rdf:li>two</rdf:li></rdf:Bag></dc:subject></rdf:Description>"
      "</rdf:RDF></x:xmpmeta>",
      "<rdf:Description><!-- c --><a b='1/2'><![CDATA[<t>]]></a><?p?></rdf:Description>",
      "<rdf:Description><photoshop:DocumentAncestors><rdf:li>d</rdf:li></photoshop:DocumentAncestors>"
      "<rdf:li dc:subject='k' dc:subject='l'/></rdf:Description><rdf:Description/></rdf:Description>"};
}
std::vector<std::string> Words() {
  return {"<rdf:Description",
          "</rdf:Description>",
          "<rdf:li>",
          "</rdf:li>",
          "<rdf:Seq>",
          "<a>",
          "</a>",
          "<!--",
          "-->",
          "<![CDATA[",
          "]]>",
          "<?",
          "?>",
          "<!DOCTYPE",
          "dc:subject=",
          "Exif:Flash='",
          "'/>",
          "exif:",
          "&amp;",
          "xml:",
          "/>"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view packet(reinterpret_cast<const char*>(data), size);
  if (!io::XmpBudget().Take(packet).empty()) return 0;
  OIIO::ImageSpec spec;
  OIIO::decode_xmp(OIIO::string_view(packet.data(), packet.size()), spec);
  fuzz::Require(spec.extra_attribs.size() <= io::XmpBudget::kMostNames, "more values than allowed");
  return 0;
}
