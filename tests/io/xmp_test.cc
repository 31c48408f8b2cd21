// XMP that would take its reader without end is refused, wherever files hold it; long histories are not.
#include <OpenImageIO/tiffutils.h>

#include <functional>
#include <string>
#include <vector>

#include "files.h"
#include "io/codec/deflate.h"
#include "io/codec/png_chunks.h"
#include "io/xmp_budget.h"

namespace tessera {
namespace {

using namespace testing_io;
using io::XmpBudget;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string Times(int count, const std::function<std::string(int)>& text) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text(i);
  return all;
}
std::string Number(int i) { return std::to_string(i); }

std::string Packet(const std::string& body) {
  return "<?xpacket begin=\"\"?><x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF><rdf:Description "
         "rdf:about=\"\">" +
         body + "</rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end=\"w\"?>";
}
std::string Nested(int levels) {
  return Packet(Times(levels, [](int) { return "<a>"; }) + "x" + Times(levels, [](int) { return "</a>"; }));
}
// Outside of a list, where nothing bounds how long what they are joined to may grow.
std::string Keywords(int count) {
  return Packet(Times(count, [](int i) { return "<rdf:li dc:subject=\"k" + Number(i) + "\"/>"; }));
}
std::string Attributes(int from, int count) {
  return Packet("<rdf:li" + Times(count, [&](int i) { return " a" + Number(from + i) + "=\"v\""; }) + "/>");
}
std::string History(int count) {
  return Packet("<xmpMM:History><rdf:Seq>" +
                Times(count,
                      [](int i) {
                        return "<rdf:li stEvt:action=\"saved\" stEvt:instanceID=\"xmp.iid:" + Number(i) +
                               "\" stEvt:when='2026-01-01T00:00:" + Number(i) + "'/>";
                      }) +
                "</rdf:Seq></xmpMM:History>");
}
std::string Ancestors(int count) {
  return Packet("<photoshop:DocumentAncestors><rdf:Bag>" +
                Times(count, [](int i) { return "<rdf:li>xmp.did:" + Number(i) + "</rdf:li>"; }) +
                "</rdf:Bag></photoshop:DocumentAncestors>");
}

std::string Refusal(const std::string& packet) { return XmpBudget().Take(packet); }

TEST(XmpBudgetTest, RefusesWhatTakesTheReaderWithoutEnd) {
  EXPECT_THAT(Refusal(Nested(250)), IsEmpty());
  EXPECT_THAT(Refusal(Nested(100000)), HasSubstr("elements in more than 256 levels"));
  EXPECT_THAT(Refusal(Keywords(2000)), IsEmpty());
  EXPECT_THAT(Refusal(Keywords(20000)), HasSubstr("items take more than 256 MiB"));
  EXPECT_THAT(Refusal(Attributes(0, 4000)), IsEmpty());
  EXPECT_THAT(Refusal(Attributes(0, 4200)), HasSubstr("more than 4096 names"));
  // As many of one image's packets together.
  XmpBudget budget;
  EXPECT_THAT(budget.Take(Attributes(0, 4000)), IsEmpty());
  EXPECT_THAT(budget.Take(Attributes(0, 4000)), IsEmpty()) << "the same names";
  EXPECT_THAT(budget.Take(Attributes(4000, 4000)), HasSubstr("more than 4096 names"));
}

TEST(XmpBudgetTest, TakesLongHistories) {
  EXPECT_THAT(Refusal(History(100000)), IsEmpty());
  EXPECT_THAT(Refusal(Ancestors(200000)), IsEmpty());
  EXPECT_THAT(Refusal(Packet("<g:Depth>" + std::string(20 << 20, 'A') + "</g:Depth>")), IsEmpty());
}

// What hides levels from a reader that looks for brackets alone.
TEST(XmpBudgetTest, ReadsAsTheReaderDoes) {
  const std::string open = Times(100, [](int) { return "<a>"; });
  for (const std::string& hidden :
       {std::string("<!-- </a></a></a> -->"), std::string("<![CDATA[</a></a></a>]]>"),
        std::string("<b c=\"</a></a></a>\"/>"), std::string("<b c='</a>\"</a></a>'/>"),
        std::string("<?p </a></a></a> ?>")}) {
    EXPECT_THAT(Refusal(Packet(Times(3, [&](int) { return open + hidden; }))), HasSubstr("256 levels"))
        << hidden;
    EXPECT_THAT(Refusal(Packet(Times(3, [&](int) { return hidden; }))), IsEmpty()) << hidden;
  }
  // The reader looks for descriptions in comments too.
  EXPECT_THAT(Refusal("<!--" + Nested(300) + "-->"), HasSubstr("256 levels"));
  EXPECT_THAT(Refusal("<rdf:Description" + Nested(300)), HasSubstr("256 levels"));
  for (const char* torn :
       {"", "<", "<rdf:Description", "<rdf:Description></rdf:Description>",
        "<rdf:Description a='</rdf:Description>", "<rdf:Description a= </rdf:Description>",
        "<rdf:Description><!--</rdf:Description>", "<rdf:Description><</rdf:Description>"}) {
    EXPECT_THAT(Refusal(torn), IsEmpty()) << torn;
  }
}

// What passes is read in a moment, of few values.
TEST(XmpBudgetTest, WhatPassesIsRead) {
  for (const std::string& packet :
       {Nested(250), Keywords(2000), Attributes(0, 4000), History(20000), Ancestors(100000)}) {
    OIIO::ImageSpec spec;
    OIIO::decode_xmp(packet, spec);
    EXPECT_LE(spec.extra_attribs.size(), XmpBudget::kMostNames);
  }
}

class XmpFileTest : public FileTest {
 protected:
  // A PNG of one pixel with these chunks behind its first.
  std::string Png(const std::string& chunks) {
    OIIO::ImageSpec spec(1, 1, 1, OIIO::TypeDesc::UINT8);
    auto out = OIIO::ImageOutput::create("png");
    out->open(Path("one.png"), spec);
    const uint8_t pixel = 7;
    out->write_image(OIIO::TypeDesc::UINT8, &pixel);
    out->close();
    const std::string whole = Contents(Path("one.png"));
    return whole.substr(0, 33) + chunks + whole.substr(33);
  }
  static std::string Chunk(const std::string& name, const std::string& bytes) {
    const std::string body = name + bytes;
    uint8_t size[4], sum[4];
    io::SetBigEndian32(size, static_cast<uint32_t>(bytes.size()));
    io::SetBigEndian32(sum, io::Crc32(0, {reinterpret_cast<const uint8_t*>(body.data()), body.size()}));
    return std::string(size, size + 4) + body + std::string(sum, sum + 4);
  }
  static std::string Zlib(const std::string& text) {
    base::Bytes out;
    io::Deflater(1).Zlib({reinterpret_cast<const uint8_t*>(text.data()), text.size()}, out);
    return {out.begin(), out.end()};
  }
  static std::string Jpeg(const std::vector<std::string>& packets) {
    std::string file = "\xFF\xD8";
    for (const std::string& packet : packets) {
      const std::string body = std::string("http://ns.adobe.com/xap/1.0/") + '\0' + packet;
      const size_t length = body.size() + 2;
      file += "\xFF\xE1";
      file += static_cast<char>(length >> 8);
      file += static_cast<char>(length & 255);
      file += body;
    }
    return file;
  }
  // A TIFF of one pixel; the packet's samples are of `width` bytes.
  static std::string Tiff(const std::string& packet, bool big_endian, bool wide, int type, int width) {
    std::string file = big_endian ? "MM" : "II";
    const auto number = [&](uint64_t value, int bytes) {
      for (int i = 0; i < bytes; ++i)
        file += static_cast<char>(value >> 8 * (big_endian ? bytes - 1 - i : i) & 255);
    };
    const int offset = wide ? 8 : 4;
    const auto entry = [&](int tag, int kind, uint64_t count, uint64_t value, int bytes) {
      number(static_cast<uint64_t>(tag), 2), number(static_cast<uint64_t>(kind), 2), number(count, offset);
      number(value, bytes);
      file.append(static_cast<size_t>(offset - bytes), '\0');
    };
    number(wide ? 43 : 42, 2);
    if (wide) number(8, 2), number(0, 2);
    const uint64_t head = wide ? 16 : 8, data = head + 300;
    number(head, offset);
    number(9, wide ? 8 : 2);
    entry(256, 3, 1, 1, 2), entry(257, 3, 1, 1, 2), entry(258, 3, 1, 8, 2), entry(259, 3, 1, 1, 2);
    entry(262, 3, 1, 1, 2), entry(273, 4, 1, data, 4), entry(278, 3, 1, 1, 2), entry(279, 4, 1, 1, 4);
    entry(700, type, packet.size(), data + 1, offset);
    number(0, offset);
    file.resize(data + 1, 'p');
    for (const char c : packet) number(static_cast<unsigned char>(c), width);
    return file;
  }
  std::string Reason(const std::string& name, const std::string& bytes) {
    SetContents(Path(name), bytes);
    return Refused(Path(name));
  }
  // Why it cannot be opened; empty where it can.
  static std::string Refused(const std::string& file) {
    try {
      Read(file);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
};

TEST_F(XmpFileTest, PngsAreLookedAt) {
  const std::string deep = Nested(300), key = "XML:com.adobe.xmp", zero(1, '\0');
  for (const std::string& chunk :
       {Chunk("tEXt", key + zero + deep), Chunk("zTXt", "xml:COM.adobe.xmp" + zero + zero + Zlib(deep)),
        Chunk("iTXt", key + zero + zero + zero + "en" + zero + zero + deep),
        Chunk("iTXt", key + zero + "\1" + zero + zero + key + zero + Zlib(deep))}) {
    EXPECT_THAT(Reason("a.png", Png(chunk)),
                HasSubstr("a.png: found elements in more than 256 levels in its XMP, expected what can be"));
  }
  EXPECT_THAT(Reason("a.png", Png(Chunk("zTXt", "Comment" + zero + zero + Zlib(deep)))), IsEmpty());
  EXPECT_THAT(Reason("a.png", Png(Chunk("zTXt", key + zero + zero + "damaged"))), IsEmpty());
  std::string several;
  for (int i = 0; i < 3; ++i) several += Chunk("zTXt", key + zero + zero + Zlib(Attributes(2000 * i, 2000)));
  EXPECT_THAT(Reason("a.png", Png(several)), HasSubstr("more than 4096 names"));
}

// A megabyte of it would unpack to one of gigabytes.
TEST_F(XmpFileTest, TextsOfAPngAreBounded) {
  const std::string zeros = std::string("Comment\0\0", 9) + Zlib(std::string(60 << 20, ' '));
  EXPECT_THAT(Reason("a.png", Png(Chunk("zTXt", zeros))), IsEmpty());
  std::string several;
  for (int i = 0; i < 5; ++i) several += Chunk("zTXt", zeros);
  EXPECT_THAT(Reason("a.png", Png(several)), HasSubstr("found texts of more than 256 MiB"));
  const std::string more = std::string("Comment\0\0", 9) + Zlib(std::string(65 << 20, ' '));
  EXPECT_THAT(Reason("a.png", Png(Chunk("zTXt", more))), HasSubstr("found a text of more than 64 MiB"));
}

TEST_F(XmpFileTest, JpegsAreLookedAt) {
  EXPECT_THAT(Reason("a.jpg", Jpeg({"", Nested(300)})), HasSubstr("256 levels"));
  EXPECT_THAT(Reason("a.jpg", Jpeg({Attributes(0, 3000), Attributes(3000, 3000)})), HasSubstr("4096 names"));
  EXPECT_THAT(Reason("a.jpg", "\xFF\xD8\x01\xFF\xFF" + Jpeg({Nested(300)}).substr(3)),
              HasSubstr("256 levels"))
      << "bytes between markers";
}

TEST_F(XmpFileTest, TiffsAreLookedAt) {
  for (const bool big_endian : {false, true}) {
    for (const bool wide : {false, true}) {
      for (const auto& [type, width] : {std::pair{1, 1}, {7, 1}, {3, 2}, {4, 4}, {16, 8}}) {
        SCOPED_TRACE(std::to_string(big_endian) + std::to_string(wide) + " type " + std::to_string(type));
        EXPECT_THAT(Reason("a.tif", Tiff(Nested(300), big_endian, wide, type, width)),
                    HasSubstr("a.tif: found elements in more than 256 levels"));
        if (type > 7) continue;
        EXPECT_THAT(Reason("a.tif", Tiff(Nested(20), big_endian, wide, type, width)), IsEmpty());
      }
    }
  }
}

// A chain of directories that share their bytes would be walked without end.
TEST_F(XmpFileTest, DirectoriesOfATiffDoNotOverlap) {
  constexpr int kEntries = 60000, kChain = 40;
  std::string file("II*\0\x08\0\0\0", 8);
  file.resize(8 + kChain * 4 + 12 * kEntries + 64, '\0');
  const auto put = [&](size_t at, uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i)
      file[at + static_cast<size_t>(i)] = static_cast<char>(value >> 8 * i & 255);
  };
  for (uint32_t k = 0; k < kChain; ++k) put(8 + 4 * k, kEntries, 2);
  for (uint32_t k = 0; k < kChain; ++k) put(8 + 4 * k + 2 + 12 * kEntries, 8 + 4 * (k + 1), 4);
  EXPECT_THAT(Reason("a.tif", file), HasSubstr("a.tif: found directories over each other"));
}

// What is within bounds arrives.
TEST_F(XmpFileTest, MetadataIsKept) {
  const std::string packet = Packet(
      "<dc:subject><rdf:Bag><rdf:li>one</rdf:li><rdf:li>two</rdf:li></rdf:Bag>"
      "</dc:subject>");
  SetContents(Path("a.tif"), Tiff(packet, false, false, 1, 1));
  SetContents(Path("a.png"), Png(Chunk("tEXt", std::string("XML:com.adobe.xmp\0", 18) + packet)));
  for (const char* name : {"a.tif", "a.png"}) {
    const auto input = OIIO::ImageInput::open(Path(name));
    ASSERT_NE(input, nullptr);
    EXPECT_EQ(input->spec().get_string_attribute("Keywords"), "one; two");
    EXPECT_THAT(Refused(Path(name)), IsEmpty());
  }
}

}  // namespace
}  // namespace tessera
