#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/team/team_file.hpp"
#include "modules/core/config.hpp"
#include "modules/link_emulation/link_emulator.hpp"

namespace km {

/// Time span in a file of links.
struct SpanKeys {
  double from_s = 0.0;
  std::optional<double> to_s;

  [[nodiscard]] RunSpan span() const {
    return {from_s, to_s.value_or(std::numeric_limits<double>::infinity())};
  }
  void visit_fields(auto& visitor) {
    visitor.field("from_s", from_s, {0.0, 1e9}, "[s since the start of the team]");
    visitor.field("to_s", to_s, {0.0, 1e9}, "[s]; default: the end");
    visitor.check(!to_s || *to_s > from_s, "to_s", "is not after from_s");
  }
};

/// Properties of a link that a file may give.
struct LinkKeys {
  std::optional<double> delay_s, jitter_s, loss, rate_bytes_per_s, queue_bytes, range_m;
  std::filesystem::path trace, packets;
  std::vector<SpanKeys> outages;

  void visit_fields(auto& visitor) {
    visitor.field("delay_s", delay_s, {0.0, 60.0}, "[s]");
    visitor.field("jitter_s", jitter_s, {0.0, 60.0},
                  "[s] random additional delay of each frame, uniform from 0 to this value: frames "
                  "may overtake others");
    visitor.field("loss", loss, {0.0, 1.0}, "probability that a frame is lost");
    visitor.field("rate_bytes_per_s", rate_bytes_per_s, {1.0, 1e12}, "[B/s]; default: no limit");
    visitor.field("queue_bytes", queue_bytes, {1514.0, 1e12},
                  "[B] size of the queue before the rate limit; frames that do not fit are lost");
    visitor.field(
        "range_m", range_m, {0.0, 1e9},
        "[m] robots further apart by their true poses do not receive each other; default: no "
        "limit. The pose of a robot is that of the present instant of its recording: --rate must "
        "not be max");
    visitor.field("trace", trace, Input{},
                  "recorded link: CSV with columns time_s, bytes_per_s, delay_s, interpolated "
                  "linearly; replaces delay_s and rate_bytes_per_s");
    visitor.field("packets", packets, Input{},
                  "recorded link: file of Mahimahi, a line for each time [ms] at which 1500 bytes "
                  "can be sent, repeated at its end; replaces rate_bytes_per_s");
    visitor.sections(
        "outages", outages,
        "times in which every frame is lost; those of a pair are added to those of all");
  }
};

/// Properties of the link from one robot to another that differ from the default.
struct PairKeys {
  std::string from, to;
  bool one_way = false;
  LinkKeys link;

  void visit_fields(auto& visitor) {
    visitor.field("from", from, "name of a robot");
    visitor.field("to", to, "name of a robot");
    visitor.field("one_way", one_way, "applies only to the direction from `from` to `to`");
    visitor.required({"from", "to"});
    visitor.check(from != to || from.empty(), "to", "is the same robot");
    link.visit_fields(visitor);
  }
};

/// Time span in which groups of robots do not receive each other.
struct PartitionKeys {
  SpanKeys when;
  std::vector<std::vector<std::string>> groups;

  void visit_fields(auto& visitor) {
    when.visit_fields(visitor);
    visitor.field("groups", groups, "lists of names; robots in none of them form one more group");
    visitor.required({"groups"});
  }
};

/// A file of links: quality of the links between the robots of a team over time.
struct LinksFile {
  std::uint32_t seed = 1;
  LinkKeys all{.delay_s = 0.0,
               .jitter_s = 0.0,
               .loss = 0.0,
               .rate_bytes_per_s = {},
               .queue_bytes = LinkPlan{}.queue_bytes,
               .range_m = {},
               .trace = {},
               .packets = {},
               .outages = {}};
  std::vector<PairKeys> pairs;
  std::vector<PartitionKeys> partitions;
  std::vector<std::string> team;  ///< Names of the robots in the team file.

  /// Index of a robot of the team by its name; nullopt if there is none.
  [[nodiscard]] std::optional<std::size_t> number_of(const std::string& robot) const;

  /// Fault of the names in `groups`; empty if they are robots, each named once.
  [[nodiscard]] std::string problem_of(const std::vector<std::vector<std::string>>& groups) const;

  void visit_fields(auto& visitor) {
    visitor.field(
        "seed", seed, {0U, 4'294'967'295U},
        "seed of all random numbers: the same seed and the same frames give the same losses");
    all.visit_fields(visitor);
    visitor.sections(
        "pairs", pairs,
        "properties that differ between two robots; the last of several entries for a pair counts");
    for (std::size_t i = 0; i < pairs.size(); ++i)
      for (const std::string& name : {pairs[i].from, pairs[i].to})
        visitor.check(name.empty() || number_of(name).has_value(), "pairs",
                      "name " + name + ", which is no robot of the team", i);
    visitor.sections("partitions", partitions,
                     "times in which groups of robots do not receive each other");
    for (std::size_t i = 0; i < partitions.size(); ++i) {
      const std::string problem = problem_of(partitions[i].groups);
      visitor.check(problem.empty(), "partitions", problem, i);
    }
  }
};

/// Reads a file of links for the robots of `plan`, in its order. Relative paths are relative to the
/// file's folder. `file` may also be a recording of Mahimahi, of either direction (.up, .down).
/// Each robot then sends to the robots after it over the uplink, and receives over the downlink.
/// Throws ConfigError with every problem by file and line, or an exception that
/// names a trace or a trajectory and its line.
[[nodiscard]] LinkScript read_links_file(const std::filesystem::path& file, const TeamPlan& plan);

/// Documentation of the keys of a file of links, with their defaults.
[[nodiscard]] std::string links_file_keys();

}  // namespace km
