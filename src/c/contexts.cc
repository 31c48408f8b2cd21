// What evaluations keep for the next ones, through the C interface: 0 is what a context keeps at first.
#include <memory>

#include "c/handles.h"
#include "tessera/context.h"

namespace tessera::c {
namespace {

ContextLimits LimitsOf(const tessera_context_limits& given) {
  ContextLimits limits;
  if (given.memory > 0) limits.memory = static_cast<size_t>(given.memory);
  if (given.cache > 0) limits.cache = static_cast<size_t>(given.cache);
  limits.whole = static_cast<size_t>(given.whole);
  return limits;
}

Context& ContextOf(const tessera_context* handle) {
  return handle == nullptr ? Context::Default() : *Checked(handle, "context").context;
}

}  // namespace
}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for

extern "C" {

tessera_status tessera_context_new(const tessera_context_limits* limits, tessera_context** context,
                                   tessera_error** error) {
  return Guarded(error, [&] {
    tessera_context*& result = Result(context, "context");
    auto made = std::make_unique<tessera_context>();
    made->context = std::make_shared<tessera::Context>(LimitsOf(Taken(limits, "limits")));
    result = made.release();
  });
}

void tessera_context_free(tessera_context* context) {
  if (context != nullptr && context->tag == Tag::kContext) delete context;
}

tessera_status tessera_context_limit(tessera_context* context, const tessera_context_limits* limits,
                                     tessera_error** error) {
  return Guarded(error, [&] { ContextOf(context).Limit(LimitsOf(Taken(limits, "limits"))); });
}

tessera_status tessera_context_get_use(const tessera_context* context, tessera_context_use* use,
                                       tessera_error** error) {
  return Guarded(error, [&] {
    const tessera::ContextUse now = ContextOf(context).Use();
    tessera_context_use given = {};
    given.memory = now.memory;
    given.cache = now.cache;
    given.entries = now.entries;
    Fill(use, given, "use");
  });
}

tessera_status tessera_context_release(tessera_context* context, tessera_error** error) {
  return Guarded(error, [&] { ContextOf(context).Release(); });
}

}  // extern "C"
