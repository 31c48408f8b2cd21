// Policies through the C interface: 0 is what holds at first.
#include "c/handles.h"
#include "tessera/context.h"
#include "tessera/sandbox.h"

namespace tessera::c {
namespace {

int64_t LimitOf(int64_t given, int64_t none, const char* name) {
  if (given < 0) throw Misuse(name, "found " + std::to_string(given) + ", expected a number of at least 0");
  return given == 0 ? none : given;
}

Policy PolicyOf(const tessera_policy& given) {
  Policy policy;
  policy.pixels = LimitOf(given.pixels, policy.pixels, "pixels");
  policy.channels = LimitOf(given.channels, policy.channels, "channels");
  policy.listed_formats = given.listed_formats != 0;
  policy.configs_inside = given.configs_inside != 0;
  policy.output_links = given.no_output_links == 0;
  if (given.sandbox < TESSERA_SANDBOX_OFF || given.sandbox > TESSERA_SANDBOX_ALL)
    throw Misuse("sandbox", "found " + std::to_string(given.sandbox) + ", expected a TESSERA_SANDBOX_...");
  policy.sandbox = static_cast<Sandbox>(given.sandbox);
  policy.reader_memory = LimitOf(given.reader_memory, policy.reader_memory, "reader_memory");
  if (!(given.reader_seconds >= 0))
    throw Misuse("reader_seconds",
                 "found " + std::to_string(given.reader_seconds) + ", expected a number of at least 0");
  if (given.reader_seconds > 0) policy.reader_seconds = given.reader_seconds;
  return policy;
}

tessera_policy PolicyOf(const Policy& policy) {
  const Policy none;
  tessera_policy given = {};
  given.pixels = policy.pixels == none.pixels ? 0 : policy.pixels;
  given.channels = policy.channels == none.channels ? 0 : policy.channels;
  given.listed_formats = policy.listed_formats;
  given.configs_inside = policy.configs_inside;
  given.no_output_links = !policy.output_links;
  given.sandbox = static_cast<tessera_sandbox>(policy.sandbox);
  given.reader_memory = policy.reader_memory == none.reader_memory ? 0 : policy.reader_memory;
  given.reader_seconds = policy.reader_seconds == none.reader_seconds ? 0 : policy.reader_seconds;
  return given;
}

}  // namespace
}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for

extern "C" {

tessera_status tessera_set_policy(const tessera_policy* given, tessera_error** error) {
  return Guarded(error, [&] { tessera::Context::Default().SetPolicy(PolicyOf(Taken(given, "policy"))); });
}

tessera_status tessera_get_policy(tessera_policy* policy, tessera_error** error) {
  return Guarded(error, [&] { Fill(policy, PolicyOf(tessera::Context::Default().policy()), "policy"); });
}

tessera_status tessera_safe_policy(tessera_policy* policy, tessera_error** error) {
  return Guarded(error, [&] { Fill(policy, PolicyOf(tessera::SafePolicy()), "policy"); });
}

tessera_status tessera_start_sandbox(tessera_error** error) {
  return Guarded(error, [&] { tessera::StartSandbox(); });
}

void tessera_end_sandbox(void) {
  Guarded(nullptr, [&] { tessera::EndSandbox(); });
}

}  // extern "C"
