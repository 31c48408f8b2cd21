// A contestant made of a name and a function.
#ifndef TESSERA_BENCH_CALL_H_
#define TESSERA_BENCH_CALL_H_

#include <functional>
#include <string>
#include <utility>

#include "contestant.h"
#include "tessera/targets.h"

namespace tessera::bench {

// `target`, when not empty, is the instruction set that it runs on.
class Call final : public Contestant {
 public:
  Call(std::string name, std::function<void()> run, std::string target = "", bool is_copy = false)
      : name_(std::move(name)), target_(std::move(target)), run_(std::move(run)), is_copy_(is_copy) {}
  std::string Name() const override { return name_; }
  void Prepare() override {
    if (!target_.empty()) SetSimdTarget(target_);
  }
  void Run() override { run_(); }
  bool IsCopy() const override { return is_copy_; }

 private:
  std::string name_, target_;
  std::function<void()> run_;
  bool is_copy_;
};

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_CALL_H_
