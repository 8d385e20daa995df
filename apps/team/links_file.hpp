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

/// Part of a run in a file of links.
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

/// What a link is like, as far as a file says.
struct LinkKeys {
  std::optional<double> delay_s, jitter_s, loss, rate_bytes_per_s, queue_bytes, range_m;
  std::filesystem::path trace;
  std::vector<SpanKeys> outages;

  void visit_fields(auto& visitor) {
    visitor.field("delay_s", delay_s, {0.0, 60.0}, "[s]");
    visitor.field(
        "jitter_s", jitter_s, {0.0, 60.0},
        "[s] more delay, drawn from 0 to this for each frame: frames may overtake others");
    visitor.field("loss", loss, {0.0, 1.0}, "probability that a frame is lost");
    visitor.field("rate_bytes_per_s", rate_bytes_per_s, {1.0, 1e12}, "[B/s]; default: no limit");
    visitor.field("queue_bytes", queue_bytes, {1514.0, 1e12},
                  "[B] what waits for the rate; frames that do not fit are lost");
    visitor.field(
        "range_m", range_m, {0.0, 1e9},
        "[m] robots further apart by their true poses do not hear each other; default: no "
        "limit. Time is that of the recording from its start: --rate must not be max");
    visitor.field("trace", trace, Input{},
                  "recorded link: CSV with columns time_s, bytes_per_s, delay_s, straight lines "
                  "between rows; in place of delay_s and rate_bytes_per_s");
    visitor.sections("outages", outages, "when every frame is lost; of a pair, further ones");
  }
};

/// What differs on the way from one robot to another.
struct PairKeys {
  std::string from, to;
  bool one_way = false;
  LinkKeys link;

  void visit_fields(auto& visitor) {
    visitor.field("from", from, "name of a robot");
    visitor.field("to", to, "name of a robot");
    visitor.field("one_way", one_way, "the way back is not meant");
    visitor.required({"from", "to"});
    visitor.check(from != to || from.empty(), "to", "is the same robot");
    link.visit_fields(visitor);
  }
};

/// A time in which the team is in groups that do not hear each other.
struct PartitionKeys {
  SpanKeys when;
  std::vector<std::vector<std::string>> groups;

  void visit_fields(auto& visitor) {
    when.visit_fields(visitor);
    visitor.field("groups", groups, "lists of names; robots in none of them are one more group");
    visitor.required({"groups"});
  }
};

/// A file of links: how well the robots of a team hear each other, and when.
struct LinksFile {
  std::uint32_t seed = 1;
  LinkKeys all{.delay_s = 0.0,
               .jitter_s = 0.0,
               .loss = 0.0,
               .rate_bytes_per_s = {},
               .queue_bytes = LinkPlan{}.queue_bytes,
               .range_m = {},
               .trace = {},
               .outages = {}};
  std::vector<PairKeys> pairs;
  std::vector<PartitionKeys> partitions;
  std::vector<std::string> team;  ///< Names of the robots, as the team file says.

  /// The number of a robot of the team; nullopt if there is none of that name.
  [[nodiscard]] std::optional<std::size_t> number_of(const std::string& robot) const;

  /// What is wrong with the names in `groups`; empty if they are robots, each named once.
  [[nodiscard]] std::string problem_of(const std::vector<std::vector<std::string>>& groups) const;

  void visit_fields(auto& visitor) {
    visitor.field("seed", seed, {0U, 4'294'967'295U},
                  "of everything random: the same seed and the same frames, the same losses");
    all.visit_fields(visitor);
    visitor.sections("pairs", pairs, "what differs between two robots; of several the last counts");
    for (std::size_t i = 0; i < pairs.size(); ++i)
      for (const std::string& name : {pairs[i].from, pairs[i].to})
        visitor.check(name.empty() || number_of(name).has_value(), "pairs",
                      "name " + name + ", which is no robot of the team", i);
    visitor.sections("partitions", partitions, "when groups of robots do not hear each other");
    for (std::size_t i = 0; i < partitions.size(); ++i) {
      const std::string problem = problem_of(partitions[i].groups);
      visitor.check(problem.empty(), "partitions", problem, i);
    }
  }
};

/// Reads a file of links for the robots of `plan`, in its order. Relative paths are relative to the
/// file's folder. Throws ConfigError with every problem by file and line, or what names a trace or
/// a trajectory and its line.
[[nodiscard]] LinkScript read_links_file(const std::filesystem::path& file, const TeamPlan& plan);

/// The keys of a file of links, with their defaults and meaning.
[[nodiscard]] std::string links_file_keys();

}  // namespace km
