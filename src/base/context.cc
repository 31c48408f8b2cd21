// The context: a pool, a cache that forgets what was asked for longest ago, and names of files.
#include "tessera/context.h"

#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <list>
#include <map>
#include <mutex>
#include <typeindex>
#include <utility>

#include "base/file_names.h"
#include "base/paged_memory.h"
#include "base/pool.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera {
namespace base {

FileNames::~FileNames() {
  for (auto& slot : slots_) std::free(slot.load());
  for (auto& name : taken_) std::free(name.load());
}

void FileNames::Remember(const std::string& name) {
  char* const copy = ::strdup(name.c_str());
  if (copy == nullptr) throw SystemError(name, "no memory for its name");
  for (auto& slot : slots_) {
    char* empty = nullptr;
    if (slot.compare_exchange_strong(empty, copy)) return;
  }
  std::free(copy);  // more outputs at once than slots: only an interrupt would leave this one behind
}

void FileNames::Forget(const std::string& name) noexcept {
  const std::lock_guard lock(forgetting_);  // other threads' names are read, which they would free
  for (auto& slot : slots_) {
    char* held = slot.load();
    // `held` can vanish through a handler all the same, which never frees.
    if (held != nullptr && name == held && slot.compare_exchange_strong(held, nullptr)) {
      std::free(held);
      return;
    }
  }
}

void FileNames::BeginStep() {
  uint32_t now = state_.load();
  do {
    while ((now & kEnded) != 0) ::pause(), now = state_.load();  // until the process is no more
  } while (!state_.compare_exchange_weak(now, now + kStep));
}

void FileNames::EndStep() {
  uint32_t now = state_.load(), next = 0;
  do {
    next = now - kStep;
    if ((next & kSteps) == 0) next &= ~kSignals;
  } while (!state_.compare_exchange_weak(now, next));
  const int signal = static_cast<int>((now & kSignals) / kSignal);
  if (signal == 0 || (next & kSignals) != 0) return;
  if (const auto handler = on_kept_.load()) handler(signal);
}

bool FileNames::MayEnd(int signal) {
  uint32_t now = state_.load(), next = 0;
  do {
    if ((now & kEnded) != 0) return false;
    const bool steps = (now & kSteps) != 0;
    if (steps && (now & kSignals) != 0) return false;
    next = steps ? now + static_cast<uint32_t>(signal) * kSignal : now | kEnded;
  } while (!state_.compare_exchange_weak(now, next));
  return (next & kEnded) != 0;
}

namespace {

class Cache {
 public:
  explicit Cache(size_t most) : most_(most) {}

  std::shared_ptr<const void> Get(const std::type_info& type, const std::string& key, size_t bytes,
                                  const std::function<std::shared_ptr<const void>()>& make) {
    const Key whole(type, key);
    if (auto found = Find(whole)) return found;
    std::shared_ptr<const void> made = make();
    const std::lock_guard lock(mutex_);
    if (const auto it = index_.find(whole); it != index_.end()) return it->second->thing;
    if (bytes > most_) return made;
    entries_.push_front({whole, made, bytes});
    index_[whole] = entries_.begin();
    total_ += bytes;
    Trim(most_);
    return made;
  }
  void Limit(size_t most) {
    const std::lock_guard lock(mutex_);
    Trim(most_ = most);
  }
  void Release() {
    const std::lock_guard lock(mutex_);
    Trim(0);
    entries_.clear(), index_.clear();  // those of no bytes
  }
  void Count(ContextUse& use) const {
    const std::lock_guard lock(mutex_);
    use.cache = total_, use.entries = entries_.size();
  }

 private:
  using Key = std::pair<std::type_index, std::string>;
  struct Entry {
    Key key;
    std::shared_ptr<const void> thing;
    size_t bytes;
  };

  std::shared_ptr<const void> Find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto it = index_.find(key);
    if (it == index_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, it->second);
    return it->second->thing;
  }
  void Trim(size_t most) {
    while (total_ > most) {
      total_ -= entries_.back().bytes;
      index_.erase(entries_.back().key);
      entries_.pop_back();
    }
  }

  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // what was asked for last first
  std::map<Key, std::list<Entry>::iterator> index_;
  size_t total_ = 0, most_;
};

}  // namespace
}  // namespace base

struct Context::State {
  explicit State(const ContextLimits& limits) : pool(limits.memory), cache(limits.cache), limits(limits) {
    paged.Limit(limits.whole);
  }
  base::Pool pool;
  base::PagedPool paged;
  base::Cache cache;
  base::FileNames files;
  mutable std::mutex mutex;  // of the following
  Policy policy;
  ContextLimits limits;
};

Context::Context(const ContextLimits& limits) : state_(std::make_unique<State>(limits)) {}
Context::~Context() = default;

// Never destroyed: pictures may outlive other globals.
Context& Context::Default() {
  static auto* const kDefault = new Context;
  return *kDefault;
}

void Context::Limit(const ContextLimits& limits) {
  state_->pool.Limit(limits.memory);
  state_->cache.Limit(limits.cache);
  state_->paged.Limit(limits.whole);
  const std::lock_guard lock(state_->mutex);
  state_->limits = limits;
}

ContextLimits Context::limits() const {
  const std::lock_guard lock(state_->mutex);
  return state_->limits;
}

void Context::SetPolicy(const Policy& policy) {
  const std::lock_guard lock(state_->mutex);
  state_->policy = policy;
}

Policy Context::policy() const {
  const std::lock_guard lock(state_->mutex);
  return state_->policy;
}

ContextUse Context::Use() const {
  ContextUse use;
  use.memory = state_->pool.kept();
  state_->cache.Count(use);
  return use;
}

void Context::Release() {
  state_->cache.Release();
  state_->pool.Release();
}

base::PagedPool& Context::paged() const { return state_->paged; }
base::Pool& Context::pool() const { return state_->pool; }
base::FileNames& Context::files() const { return state_->files; }

std::shared_ptr<const void> Context::CachedAs(const std::type_info& type, const std::string& key,
                                              size_t bytes,
                                              const std::function<std::shared_ptr<const void>()>& make) {
  return state_->cache.Get(type, key, bytes, make);
}

}  // namespace tessera
