// Phases of several evaluations, and which one is the limit.
#include <algorithm>
#include <utility>

#include "tessera/render.h"

namespace tessera {

std::string RunPhases::Limit() const {
  std::pair<double, std::string> limit(prepare, "prepare");
  for (const Decode& d : decode) limit = std::max(limit, std::pair(d.elapsed, "decode " + d.file));
  limit = std::max(limit, std::pair(compute / std::max(1, threads), std::string("compute")));
  return std::max(limit, std::pair(encode_elapsed, std::string("encode"))).second;
}

void RunPhases::Add(const RunPhases& other) {
  for (const Decode& d : other.decode) {
    auto at =
        std::find_if(decode.begin(), decode.end(), [&](const Decode& own) { return own.file == d.file; });
    if (at == decode.end()) at = decode.insert(at, {d.file});
    at->busy += d.busy;
    at->elapsed += d.elapsed;
  }
  prepare += other.prepare;
  compute += other.compute;
  encode += other.encode;
  encode_elapsed += other.encode_elapsed;
  wait += other.wait;
  threads = std::max(threads, other.threads);
  seconds += other.seconds;
}

}  // namespace tessera
