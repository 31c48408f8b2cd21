// The C interface: any order of calls, with values, names and handles of any kind, is answered with a status.
#include <array>

#include "c/handles.h"
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "random/values.h"

using namespace tessera;

namespace {

constexpr size_t kHandles = 4;
constexpr size_t kSide = 16, kChannels = 8, kBytes = kSide * kSide * kChannels * 4 * 4;

// A few of each; those that are freed are null.
struct Machine {
  std::array<tessera_image*, kHandles> images = {};
  std::array<tessera_parameters*, kHandles> parameters = {};
  std::vector<char> memory = std::vector<char>(kBytes);
  tessera_context* context = nullptr;

  Machine() { tessera_context_new(nullptr, &context, nullptr); }
  ~Machine() {
    tessera_context_free(context);
    for (tessera_image* i : images) tessera_image_free(i);
    for (tessera_parameters* p : parameters) tessera_parameters_free(p);
  }
};

// What every answer has to be.
template <typename Call>
tessera_status Check(const Call& call) {
  tessera_error* error = nullptr;
  const tessera_status status = call(&error);
  fuzz::Require(status >= TESSERA_OK && status <= TESSERA_SYSTEM, "a fault of the library, or no status");
  fuzz::Require((status == TESSERA_OK) == (error == nullptr),
                "a status without an error, or the other way round");
  fuzz::Require(tessera_error_status(error) == status, "an error of another status");
  fuzz::Require(error == nullptr || *tessera_error_reason(error) != 0, "an error without a reason");
  tessera_error_free(error);
  return status;
}

// Pixels within the memory; what else there may be in the structure is anything.
tessera_pixels PixelsOf(fuzz::Input& in, Machine& m) {
  tessera_pixels p = TESSERA_INIT(tessera_pixels);
  p.data = in.Below(16) == 0 ? nullptr : m.memory.data();
  p.window.x0 = in.Take<int8_t>(), p.window.y0 = in.Take<int8_t>();
  p.window.x1 = p.window.x0 + in.Take<uint8_t>() % 17, p.window.y1 = p.window.y0 + in.Take<uint8_t>() % 17;
  p.channels = in.Take<uint8_t>() % 9;
  p.type = in.Take<uint8_t>() % 6;
  if (in.Below(4) == 0) {  // gaps, as large as the memory has room for
    const int64_t sample = p.type == TESSERA_FLOAT ? 4 : p.type == TESSERA_UINT8 ? 1 : 2;
    p.channel_stride = sample, p.pixel_stride = sample * kChannels, p.row_stride = p.pixel_stride * 17;
  }
  return p;
}

// Small values, limits, or any bits.
double NumberOf(fuzz::Input& in) {
  const size_t kind = in.Below(4);
  return kind == 0   ? in.Take<double>()
         : kind == 1 ? in.Take<float>()
                     : in.Take<int8_t>() / (kind == 2 ? 1.0 : 16.0);
}

// The same answer, and the same bits, in a context of its own, from an image that was prepared and freed.
void RenderPrepared(Machine& m, tessera_image*& image, tessera_pixels out, tessera_render_options options,
                    tessera_status status, const std::vector<char>& want) {
  Check([&](tessera_error** error) { return tessera_context_release(m.context, error); });
  options.context = m.context;
  tessera_prepared* prepared = nullptr;
  tessera_status again =
      Check([&](tessera_error** error) { return tessera_prepare(image, &options, &prepared, error); });
  tessera_image_free(image);
  image = nullptr;
  std::vector<char> room(kBytes);
  if (out.data != nullptr) out.data = room.data();
  if (again == TESSERA_OK) {
    again = Check([&](tessera_error** error) {
      return tessera_prepared_render(prepared, &out, nullptr, nullptr, error);
    });
  }
  tessera_prepared_free(prepared);
  fuzz::Require(again == status, "a prepared graph that ends otherwise");
  fuzz::Require(status != TESSERA_OK || room == want, "a prepared graph with other bits");
}

void Call(fuzz::Input& in, Machine& m) {
  const size_t what = in.Below(12), i = in.Below(kHandles), k = in.Below(kHandles);
  tessera_image*& image = m.images[i];
  tessera_parameters*& parameters = m.parameters[k];
  const auto& rows = ops::Registry();
  const std::string text = parameters != nullptr && in.Below(4) > 0 && !parameters->op->modifiers.empty()
                               ? in.Of(parameters->op->modifiers).name
                               : std::string(in.Until('\n'));
  switch (what) {
    case 0: {
      const tessera_pixels p = PixelsOf(in, m);
      tessera_image* made = nullptr;
      tessera_image_options options = TESSERA_INIT(tessera_image_options);
      options.channels = in.Below(4) == 0 ? text.c_str() : nullptr;
      options.alpha = in.Below(4) == 0 ? text.c_str() : nullptr;
      const bool copied = in.Below(2) == 0;
      Check([&](tessera_error** error) {
        return copied ? tessera_image_copy(&p, &options, &made, error)
                      : tessera_image_borrow(&p, &options, nullptr, nullptr, &made, error);
      });
      tessera_image_free(image);
      image = made;
      break;
    }
    case 1: {
      tessera_parameters* made = nullptr;
      const std::string name = in.Below(8) > 0 ? rows[in.Take<uint16_t>() % rows.size()].name : text;
      Check([&](tessera_error** error) { return tessera_parameters_new(name.c_str(), &made, error); });
      tessera_parameters_free(parameters);
      parameters = made;
      break;
    }
    case 2:
      Check([&](tessera_error** error) {
        return tessera_set_number(parameters, text.c_str(), NumberOf(in), error);
      });
      break;
    case 3:
      Check([&](tessera_error** error) {
        return tessera_set_integer(parameters, text.c_str(),
                                   in.Below(2) == 0 ? in.Take<int8_t>() : in.Take<int64_t>(), error);
      });
      break;
    case 4:
      Check([&](tessera_error** error) {
        return tessera_set_flag(parameters, text.c_str(), in.Take<int8_t>(), error);
      });
      break;
    case 5: {
      std::vector<double> values(in.Below(40));
      for (double& v : values) v = NumberOf(in);
      Check([&](tessera_error** error) {
        return tessera_set_numbers(parameters, text.c_str(), values.data(), values.size(), error);
      });
      break;
    }
    case 6: {
      const std::string value(in.Until('\n'));
      if (value.find('/') != std::string::npos) break;
      Check([&](tessera_error** error) {
        return tessera_set_text(parameters, text.c_str(), value.c_str(), error);
      });
      break;
    }
    case 7: {
      if (parameters == nullptr || parameters->op->examples.empty()) break;
      const std::string line = in.Below(2) == 0 ? text : in.Of(parameters->op->examples);
      if (line.find('/') != std::string::npos) break;
      Check([&](tessera_error** error) { return tessera_parameters_parse(parameters, line.c_str(), error); });
      break;
    }
    case 8: {  // an operation, or a generator
      if (parameters != nullptr) {
        bool cheap = false;
        fuzz::Try([&] { cheap = random::IsCheap(*parameters->op, c::ArgumentsOf(*parameters)); });
        if (!cheap) break;
      }
      tessera_image* made = nullptr;
      if (parameters != nullptr && parameters->op->generator && in.Below(8) > 0) {
        const tessera_window window = {in.Take<int8_t>(), in.Take<int8_t>(), in.Take<int8_t>(),
                                       in.Take<int8_t>()};
        Check([&](tessera_error** error) {
          return tessera_generate(parameters, &window, in.Take<uint8_t>() % 9, &made, error);
        });
      } else {
        const tessera_image* inputs[] = {m.images[0], m.images[1], m.images[2], m.images[3]};
        Check([&](tessera_error** error) {
          return tessera_apply(parameters, inputs, in.Below(5), &made, error);
        });
      }
      tessera_image_free(image);
      image = made;
      break;
    }
    case 9: {
      tessera_pixels out = PixelsOf(in, m);
      tessera_image_info info = TESSERA_INIT(tessera_image_info);
      if (in.Below(2) == 0) info.struct_size = in.Below(80);
      Check([&](tessera_error** error) { return tessera_image_get_info(image, &info, error); });
      // Borrowed images read the memory that is written: their pixels are anything then.
      std::vector<char> room(kBytes);
      if (out.data != nullptr) out.data = room.data();
      tessera_render_options options = TESSERA_INIT(tessera_render_options);
      options.threads = 1;
      const tessera_status status =
          Check([&](tessera_error** error) { return tessera_render(image, &out, &options, error); });
      if (in.Below(2) == 0) RenderPrepared(m, image, out, options, status, room);
      break;
    }
    case 10: {
      size_t count = 0;
      Check([&](tessera_error** error) { return tessera_parameters_images(parameters, &count, error); });
      const tessera_operation* const operation = tessera_operation_at(in.Take<uint16_t>());
      tessera_operation_info info = TESSERA_INIT(tessera_operation_info);
      Check([&](tessera_error** error) { return tessera_operation_get_info(operation, &info, error); });
      tessera_parameter_info parameter = TESSERA_INIT(tessera_parameter_info);
      Check([&](tessera_error** error) {
        return tessera_parameter_get_info(operation, in.Take<uint8_t>(), &parameter, error);
      });
      tessera_parameter_choice(operation, in.Take<uint8_t>(), in.Take<uint8_t>());
      tessera_parameter_count(operation, in.Take<uint8_t>(), in.Take<uint8_t>());
      tessera_image_channel(image, in.Take<int16_t>());
      break;
    }
    default:
      tessera_image_free(image), tessera_parameters_free(parameters);
      image = nullptr, parameters = nullptr;
  }
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  // Pixels, parameters, an example of them, the operation, its pixels.
  for (size_t row = 0; row < ops::Registry().size(); ++row) {
    const ops::OpInfo& op = ops::Registry()[row];
    std::string seed;
    const auto put = [&seed](std::initializer_list<int> bytes) {
      for (const int b : bytes) seed += static_cast<char>(b);
    };
    for (int i = 0; i < 4; ++i) put({0, i, 0, '\n', 1, 0, 0, 9, 7, 4, TESSERA_FLOAT, 1, 1, 1, 0});
    put({1, 0, 0, '\n', 1, static_cast<int>(row & 255), static_cast<int>(row >> 8)});
    put({7, 0, 0, 0, '\n', 1, 0, 0, 8, 0, 0, 0, '\n'});
    op.generator ? put({1, 0, 0, 9, 7, 4}) : put({op.inputs});
    put({9, 0, 0, 0, '\n', 1, 0, 0, 9, 7, 4, TESSERA_FLOAT, 1, 1});
    seeds.push_back(seed);
  }
  return seeds;
}
std::vector<std::string> Words() {
  std::vector<std::string> words = RegistryWords();
  words.insert(words.end(), {"\n", "R,G,B,A", "A", "\1", "\x08", "\x09"});
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  Machine machine;
  for (int calls = 0; calls < 32 && !in.empty(); ++calls) Call(in, machine);
  return 0;
}
