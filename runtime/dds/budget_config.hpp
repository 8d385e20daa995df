#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Limits on the bytes that a robot sends. Counted are the bytes of messages as in traffic.csv:
/// once per addressee, and once more for each retransmission. 0: no limit. See SendBudget.
struct BudgetConfig {
  static constexpr const char* kSection = "budget";

  double bytes_per_s = 0.0;
  double bytes_per_run = 0.0;
  double verification_bytes_per_s = 0.0;
  double poses_bytes_per_s = 0.0;
  double words_bytes_per_s = 0.0;
  double mesh_bytes_per_s = 0.0;
  double peer_bytes_per_s = 0.0;

  [[nodiscard]] bool is_limited() const {
    return bytes_per_s > 0.0 || bytes_per_run > 0.0 || verification_bytes_per_s > 0.0 ||
           poses_bytes_per_s > 0.0 || words_bytes_per_s > 0.0 || mesh_bytes_per_s > 0.0 ||
           peer_bytes_per_s > 0.0;
  }

  void visit_fields(auto& visitor) {
    visitor.field(
        "bytes_per_s", bytes_per_s, {0.0, 1e12},
        "[B/s] that this robot sends, including each receiver and retransmissions; further "
        "messages wait, in this order of priority: closures, verification, poses, new words, older "
        "words, mesh; statuses are counted but never wait; 0, here and below: no limit");
    visitor.field("bytes_per_run", bytes_per_run, {0.0, 1e15},
                  "[B] in the whole run: the mesh may use the first 60 %, words 80 %, verification "
                  "90 %, poses 95 %, closures all of them");
    visitor.field("verification_bytes_per_s", verification_bytes_per_s, {0.0, 1e12},
                  "[B/s] part of bytes_per_s for requested keyframes");
    visitor.field("poses_bytes_per_s", poses_bytes_per_s, {0.0, 1e12}, "[B/s] for the pose graph");
    visitor.field("words_bytes_per_s", words_bytes_per_s, {0.0, 1e12},
                  "[B/s] for bags of words, new and older ones together");
    visitor.field("mesh_bytes_per_s", mesh_bytes_per_s, {0.0, 1e12}, "[B/s] for the mesh");
    visitor.field(
        "peer_bytes_per_s", peer_bytes_per_s, {0.0, 1e12},
        "[B/s] to any one robot; a message to all is sent when the limit of each robot permits it");
  }
};

}  // namespace km
