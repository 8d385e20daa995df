#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Limits on the bytes that a robot sends. Counted are the bytes of messages as in traffic.csv:
/// once per addressee, and once more for each retransmission. 0: no limit. See SendSchedule.
struct BudgetConfig {
  static constexpr const char* kSection = "budget";

  double bytes_per_s = 0.0;
  double bytes_per_run = 0.0;

  [[nodiscard]] bool is_limited() const { return bytes_per_s > 0.0 || bytes_per_run > 0.0; }

  void visit_fields(auto& visitor) {
    visitor.field(
        "bytes_per_s", bytes_per_s, {0.0, 1e12},
        "[B/s] that this robot sends, including each receiver and retransmissions; further "
        "messages wait, in this order of priority: closures, verification, poses, new words, older "
        "words, mesh; statuses are counted but never wait; 0: no limit");
    visitor.field("bytes_per_run", bytes_per_run, {0.0, 1e15},
                  "[B] in the whole run: the mesh may use the first 60 %, words 80 %, verification "
                  "90 %, poses 95 %, closures all of them; 0: no limit");
  }
};

}  // namespace km
