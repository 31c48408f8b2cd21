/// What evaluations keep for the next ones, and who owns it. @file
#ifndef TESSERA_CONTEXT_H_
#define TESSERA_CONTEXT_H_

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <typeinfo>

#include "tessera/export.h"
#include "tessera/policy.h"

TESSERA_API_BEGIN
namespace tessera {

namespace base {
class Pool;
class PagedPool;
class FileNames;
}  // namespace base

/// How much a context keeps.
struct ContextLimits {
  size_t memory = size_t{320} << 20;  ///< bytes of pictures given back, for the next ones of their size
  size_t cache = size_t{256} << 20;   ///< bytes of prepared things: tables, distance fields, fits

  /// Bytes of one thing held whole (a picture, a table, a volume). What is larger lies in a nameless file in
  /// $TMPDIR, else /var/tmp, about as much of it resident. Results are the same bits. 0: all is in memory.
  size_t whole = 0;
};

/// How much it holds at a moment.
struct ContextUse {
  size_t memory = 0;   ///< bytes kept for the next pictures
  size_t cache = 0;    ///< bytes of prepared things
  size_t entries = 0;  ///< how many prepared things
};

/// Memory that pictures gave back, things that do not change from one evaluation to the next, and names of
/// unfinished files. Several threads may use one context, and several contexts live side by side: they share
/// nothing. Pictures may outlive the context that they were made in; results never depend on one.
class Context {
 public:
  /// Keeps no more than that.
  explicit Context(const ContextLimits& limits = {});
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// The one that is used where none is named. It lives until the process ends.
  static Context& Default();

  /// Keeps no more than that from here on.
  void Limit(const ContextLimits& limits);
  /// What was asked for last.
  ContextLimits limits() const;
  /// What files may ask for from here on. Files, configs and outputs that no context is named for are held
  /// against that of Default().
  void SetPolicy(const Policy& policy);
  /// The one that holds now.
  Policy policy() const;
  /// What is kept now.
  ContextUse Use() const;
  /// Gives back all that is kept and that nobody uses.
  void Release();

  /// The thing of that key and type: kept from before, or made now by make(), which returns a
  /// std::shared_ptr<const T> of about `bytes` bytes. The key must hold all that the thing depends on. What
  /// was asked for longest ago goes first when the limit is reached; larger things are not kept. Threads that
  /// ask at once for what is not there may each make it; all get the first.
  template <typename T, typename Make>
  std::shared_ptr<const T> Cached(const std::string& key, size_t bytes, const Make& make) {
    return std::static_pointer_cast<const T>(CachedAs(typeid(T), key, bytes, [&make] {
      return std::shared_ptr<const void>(std::shared_ptr<const T>(make()));
    }));
  }

  /// The library's own.
  base::Pool& pool() const;
  /// The library's own.
  base::PagedPool& paged() const;
  /// The library's own.
  base::FileNames& files() const;

 private:
  std::shared_ptr<const void> CachedAs(const std::type_info& type, const std::string& key, size_t bytes,
                                       const std::function<std::shared_ptr<const void>()>& make);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_CONTEXT_H_
