// Reads expressions: numbers, texts, variables, metadata of images on the stack, arithmetic, comparisons.
#include "cli/expression.h"

#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>

#include "cli/session.h"
#include "cli/statistics.h"
#include "tessera/error_kind.h"
#include "tessera/metadata.h"
#include "tessera/ops/accumulate.h"

namespace tessera::cli {

const char* const kExpressionHelp =
    "{...} in a word is an expression, and its value takes its place as the command is reached. TOP is the image on "
    "top, IMG[0] as well, IMG[1] the one below, IMG[NAME] a file: {TOP.width}, {TOP.nchannels}, {TOP.filename}, "
    "{TOP.file_extension}, {TOP.file_noextension}, {TOP.geom}, {TOP.'Exif:FNumber'} and every other item; with brackets, "
    "{TOP[Artist]}, one that is not there is nothing, no error. {TOP.MINCOLOR}, MAXCOLOR, AVGCOLOR, STATS (which "
    "compute the image), META, METABRIEF. FRAME_NUMBER; variables of --set and --for, also var(NAME); getattribute(NAME) "
    "of OpenImageIO. + - * / // (whole) % (rest), < > <= >= == != <=> && || from left to right, * / // % first; "
    "! before a value, parentheses, eq(A,B), neq(A,B), not(A) for texts in quotes. Numbers come out with six digits, "
    "whole ones in full. As oiiotool's, and beyond it jitterx(N,K) and jittery(N,K): where sample K of N, from 0, lies in a "
    "pixel, from its middle (McReynolds et al. 1997, 7.5, for 2 to 6, 8, 9, 12 and 16; lattices for other N), for lines "
    "that are summed: --for i 8 ... --shift {jitterx(8,i)},{jittery(8,i)} --endfor --average 8.";

namespace {

using OIIO::Strutil::sprintf;

std::string ColorText(const std::vector<double>& color) {
  std::string text;
  for (const double v : color) text += (text.empty() ? "" : ",") + sprintf("%g", v);
  return text;
}

std::string WithoutEnd(std::string text) {
  if (text.ends_with('\n')) text.pop_back();
  return text;
}

std::string WithoutIndents(const std::string& text) {
  std::vector<std::string> lines;
  OIIO::Strutil::split(text, lines, "\n");
  for (std::string& line : lines) line.erase(0, line.find_first_not_of(' '));
  return OIIO::Strutil::join(lines, "\n");
}

std::optional<double> NumberIn(const std::string& text) {
  double value = 0;
  const std::string plain = OIIO::Strutil::strip(text);
  const char* const begin = plain.data() + (plain.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, plain.data() + plain.size(), value);
  if (plain.empty() || error != std::errc() || end != plain.data() + plain.size()) return std::nullopt;
  return value;
}

class Reader {
 public:
  Reader(std::string_view text, Session& session) : whole_(text), rest_(text), session_(session) {}

  std::string Value() {
    const std::string value = Sum();
    Skip();
    if (!rest_.empty()) Refuse("the end");
    return value;
  }

 private:
  [[noreturn]] void Refuse(const std::string& expected) const {
    throw UsageError("{" + std::string(whole_) + "}",
                     "found \"" + std::string(rest_) + "\", expected " + expected +
                         "; --help evalon tells what braces hold, --evaloff leaves them as they are");
  }
  void Skip() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\n"), rest_.size())); }
  bool Take(std::string_view word) {
    Skip();
    if (!rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }
  std::string Identifier(std::string_view more = "") {
    Skip();
    size_t n = 0;
    const auto fits = [&](char c) {
      return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_' ||
             (n > 0 && std::isdigit(static_cast<unsigned char>(c)) != 0) ||
             (n > 0 && more.find(c) != std::string_view::npos);
    };
    while (n < rest_.size() && fits(rest_[n])) ++n;
    const std::string name(rest_.substr(0, n));
    rest_.remove_prefix(n);
    return name;
  }
  bool TakeFunction(std::string_view name) {
    const std::string_view before = rest_;
    if (Identifier() == name && Take("(")) return true;
    rest_ = before;
    return false;
  }
  std::string Quoted() {
    Skip();
    const char quote = rest_.front();
    const size_t end = rest_.find(quote, 1);
    if (end == std::string_view::npos) Refuse("a closing quote");
    const std::string text(rest_.substr(1, end - 1));
    rest_.remove_prefix(end + 1);
    return text;
  }
  bool AtQuote() {
    Skip();
    return !rest_.empty() && (rest_.front() == '"' || rest_.front() == '\'');
  }
  double Number(const std::string& text) const {
    const std::optional<double> value = NumberIn(text);
    if (!value) {
      throw UsageError("{" + std::string(whole_) + "}",
                       "found \"" + text + "\", expected a number beside + - * / and comparisons");
    }
    return *value;
  }

  std::string Sum() {
    std::string left = Product();
    constexpr std::string_view kOperators[] = {"<=>", "<=", ">=", "==", "!=", "&&", "||",
                                               "+",   "-",  "<",  ">",  "&",  "|"};
    while (true) {
      const auto it =
          std::find_if(std::begin(kOperators), std::end(kOperators), [&](auto word) { return Take(word); });
      if (it == std::end(kOperators)) return left;
      const double a = Number(left), b = Number(Product());
      left = NumberOf(Compute(*it, a, b));
    }
  }
  static double Compute(std::string_view op, double a, double b) {
    if (op == "+") return a + b;
    if (op == "-") return a - b;
    if (op == "<=>") return a < b ? -1 : a > b ? 1 : 0;
    const bool both = a != 0 && b != 0, one = a != 0 || b != 0;
    return (op == "<"      ? a < b
            : op == ">"    ? a > b
            : op == "<="   ? a <= b
            : op == ">="   ? a >= b
            : op == "=="   ? a == b
            : op == "!="   ? a != b
            : op[0] == '&' ? both
                           : one)
               ? 1
               : 0;
  }
  std::string Product() {
    std::string left = Atom();
    while (true) {
      if (Take("*")) {
        left = NumberOf(Number(left) * Number(Atom()));
      } else if (Take("//")) {
        const double a = std::trunc(Number(left)), b = std::trunc(Number(Atom()));
        left = NumberOf(b == 0 ? 0 : std::trunc(a / b));
      } else if (Take("/")) {
        const double a = Number(left);
        left = NumberOf(a / Number(Atom()));
      } else if (Take("%")) {
        const double a = std::trunc(Number(left)), b = std::trunc(Number(Atom()));
        left = NumberOf(b == 0 ? 0 : std::fmod(a, b));
      } else {
        return left;
      }
    }
  }
  std::string Atom() {
    if (++depth_ > 100) Refuse("fewer parentheses");
    bool negative = false, inverted = false;
    while (true) {
      if (Take("-")) {
        negative = !negative;
      } else if (Take("!")) {
        inverted = !inverted;
      } else if (!Take("+")) {
        break;
      }
    }
    std::string value = Plain();
    --depth_;
    if (negative) value = NumberIn(value) ? NumberOf(-*NumberIn(value)) : "-" + value;
    if (inverted) value = IsTrue(value) ? "0" : "1";
    return value;
  }
  std::string Plain() {
    if (Take("(")) {
      std::string value = Sum();
      if (!Take(")")) Refuse("a closing parenthesis");
      return value;
    }
    if (AtQuote()) return Quoted();
    for (const bool equal : {true, false}) {
      if (!TakeFunction(equal ? "eq" : "neq")) continue;
      const std::string a = Sum();
      if (!Take(",")) Refuse("a comma");
      const std::string b = Sum();
      if (!Take(")")) Refuse("a closing parenthesis");
      return (a == b) == equal ? "1" : "0";
    }
    if (TakeFunction("not")) {
      const std::string value = Sum();
      if (!Take(")")) Refuse("a closing parenthesis");
      return IsTrue(value) ? "0" : "1";
    }
    if (TakeFunction("var")) return Variable(Name());
    if (TakeFunction("getattribute")) return GlobalAttribute(Name());
    if (TakeFunction("jitterx")) return Jittered(true);
    if (TakeFunction("jittery")) return Jittered(false);
    if (Take("IMG[")) return OfImage(IndexedImage());
    const std::string_view before = rest_;
    const std::string word = Identifier();
    if (word == "TOP") return OfImage(ImageAt(0));
    if (word == "FRAME_NUMBER" || word == "FRAME_NUMBER_PAD") return Frame(word == "FRAME_NUMBER_PAD");
    if (session_.flow.variables.contains(word)) return Variable(word);
    rest_ = before;
    double value = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc()) Refuse("a number, a text in quotes, TOP, IMG[n] or a variable");
    rest_.remove_prefix(static_cast<size_t>(end - rest_.data()));
    return NumberOf(value);
  }
  // Of so many samples' places in a pixel the one of that number, from its middle.
  std::string Jittered(bool x) {
    const double count = Number(Sum());
    if (!Take(",")) Refuse("a comma");
    const double which = Number(Sum());
    if (!Take(")")) Refuse("a closing parenthesis");
    if (!(count >= 1 && count <= 65536 && count == std::floor(count) && which == std::floor(which) &&
          which >= 0 && which < count)) {
      throw UsageError("{" + std::string(whole_) + "}",
                       "found sample " + NumberOf(which) + " of " + NumberOf(count) +
                           ", expected whole numbers, 1 to 65536 samples, counted from 0");
    }
    const JitterPoint place = JitterSet(static_cast<int>(count))[static_cast<size_t>(which)];
    return NumberOf((x ? place.x : place.y) - 0.5);
  }
  // Up to a closing parenthesis.
  std::string Name() {
    std::string name;
    if (AtQuote()) {
      name = Quoted();
    } else {
      name = OIIO::Strutil::strip(std::string(rest_.substr(0, rest_.find(')'))));
      rest_.remove_prefix(std::min(rest_.find(')'), rest_.size()));
    }
    if (!Take(")")) Refuse("a closing parenthesis");
    return name;
  }
  std::string Variable(const std::string& name) const {
    const auto it = session_.flow.variables.find(name);
    return it == session_.flow.variables.end() ? "" : it->second;
  }
  static std::string GlobalAttribute(const std::string& name) {
    std::string text;
    int whole = 0;
    float number = 0;
    if (OIIO::getattribute(name, text)) return text;
    if (OIIO::getattribute(name, whole)) return std::to_string(whole);
    if (OIIO::getattribute(name, number)) return sprintf("%g", number);
    throw UsageError("getattribute(" + name + ")", "OpenImageIO has no such attribute");
  }
  std::string Frame(bool padded) const {
    const int width = padded ? std::max(1, session_.options().frame_padding) : 1;
    return sprintf("%0*d", width, session_.frame);
  }

  const Entry& ImageAt(int depth) {
    if (depth < 0 || depth >= session_.Depth())
      throw UsageError("{" + std::string(whole_) + "}",
                       "the stack holds " + std::to_string(session_.Depth()) + " images here");
    return session_.Top(depth);
  }
  const Entry& IndexedImage() {
    Skip();
    const size_t close = rest_.find(']');
    if (close == std::string_view::npos) Refuse("a closing bracket");
    std::string which = OIIO::Strutil::strip(std::string(rest_.substr(0, close)));
    rest_.remove_prefix(close + 1);
    if (which.find_first_not_of("0123456789") == std::string::npos && !which.empty() && which.size() < 6)
      return ImageAt(std::stoi(which));
    if (which.size() > 1 && (which[0] == '"' || which[0] == '\'')) which = which.substr(1, which.size() - 2);
    if (const auto label = session_.labels.find(which); label != session_.labels.end()) return label->second;
    read_ = {
        Read(which, {.codec = session_.options().codec, .formats = session_.options().formats}), which, {}};
    return read_;
  }

  // .NAME or [NAME] of it.
  std::string OfImage(const Entry& entry) {
    const bool bracket = Take("[");
    if (!bracket && !Take(".")) Refuse(". or [ and a name");
    const std::string name = AtQuote() ? Quoted() : Identifier(":");
    if (bracket && !Take("]")) Refuse("a closing bracket");
    const ImageSpec& spec = entry.node.spec();
    if (const auto value = DescribedValue(spec, entry.attributes, name)) return *value;
    if (const auto value = OfFile(entry, name)) return *value;
    if (name == "META" || name == "METABRIEF") {
      InfoOptions info;
      info.verbose = name == "META";
      return WithoutEnd(InfoText(spec, entry.attributes, info));
    }
    if (name.ends_with("COLOR") || name == "STATS") {
      if (session_.options().dry_run) return "0";
      const RenderOptions& render = session_.options().render;
      if (name == "STATS") return WithoutIndents(WithoutEnd(StatsText(entry.node, render)));
      const ColorExtremes colors = ExtremesOf(entry, render);
      if (name == "MINCOLOR") return ColorText(colors.min);
      if (name == "MAXCOLOR") return ColorText(colors.max);
      if (name == "AVGCOLOR") return ColorText(colors.mean);
    }
    if (bracket) return "";
    throw UsageError("{" + std::string(whole_) + "}", "found no \"" + name + "\" in the image; [" + name +
                                                          "] in place of ." + name + " is empty then");
  }
  static std::optional<std::string> OfFile(const Entry& entry, const std::string& name) {
    const std::string& file = entry.file.empty() ? entry.name : entry.file;
    const std::string extension = std::filesystem::path(file).extension().string();
    if (name == "filename") return file;
    if (name == "file_extension") return extension;
    if (name == "file_noextension") return file.substr(0, file.size() - extension.size());
    return std::nullopt;
  }

  std::string_view whole_, rest_;
  Session& session_;
  Entry read_;
  int depth_ = 0;
};

// The brace that closes the one at `open`; npos for none.
size_t Closing(const std::string& word, size_t open) {
  int depth = 0;
  for (size_t i = open; i < word.size(); ++i) {
    depth += word[i] == '{' ? 1 : word[i] == '}' ? -1 : 0;
    if (depth == 0) return i;
  }
  return std::string::npos;
}

}  // namespace

bool HoldsExpression(const std::string& word) {
  const size_t open = word.find('{');
  return open != std::string::npos && Closing(word, open) != std::string::npos;
}

std::string Evaluate(const std::string& word, Session& session) {
  std::string result;
  size_t at = 0;
  while (true) {
    const size_t open = word.find('{', at), close = open == std::string::npos ? open : Closing(word, open);
    if (close == std::string::npos) return result + word.substr(at);
    result += word.substr(at, open - at) +
              Reader(std::string_view(word).substr(open + 1, close - open - 1), session).Value();
    at = close + 1;
  }
}

bool IsTrue(const std::string& value) {
  const std::string plain = OIIO::Strutil::strip(value);
  if (const auto number = NumberIn(plain)) return *number != 0;
  return !plain.empty() && !OIIO::Strutil::iequals(plain, "false") && !OIIO::Strutil::iequals(plain, "no") &&
         !OIIO::Strutil::iequals(plain, "off");
}

std::string NumberOf(double value) {
  constexpr double kWhole = 1e15;
  if (value == std::trunc(value) && std::fabs(value) < kWhole) return sprintf("%.0f", value + 0.0);
  return sprintf("%g", value);
}

}  // namespace tessera::cli
