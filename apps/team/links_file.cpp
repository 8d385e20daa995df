#include "apps/team/links_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <set>

#include "apps/team/team_results.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "runtime/config_text.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// The values of `own`, and those of `usual` for missing ones.
LinkKeys merged(LinkKeys usual, const LinkKeys& own) {
  for (const auto key : {&LinkKeys::delay_s, &LinkKeys::jitter_s, &LinkKeys::loss,
                         &LinkKeys::rate_bytes_per_s, &LinkKeys::queue_bytes, &LinkKeys::range_m})
    if (own.*key) usual.*key = own.*key;
  if (!own.trace.empty() || own.delay_s || own.rate_bytes_per_s) usual.trace = own.trace;
  if (!own.packets.empty() || !own.trace.empty() || own.rate_bytes_per_s)
    usual.packets = own.packets;
  usual.outages.insert(usual.outages.end(), own.outages.begin(), own.outages.end());
  return usual;
}

LinkPlan plan_of(const LinkKeys& keys) {
  LinkPlan link;
  if (keys.trace.empty())
    link.trace = LinkTrace({{.bytes_per_s = keys.rate_bytes_per_s.value_or(kUnlimited),
                             .delay_s = keys.delay_s.value_or(0.0)}});
  else
    link.trace = read_link_trace(keys.trace);
  if (!keys.packets.empty()) link.packets = read_packet_schedule(keys.packets);
  link.jitter_s = keys.jitter_s.value_or(link.jitter_s);
  link.loss = keys.loss.value_or(link.loss);
  link.queue_bytes = keys.queue_bytes.value_or(link.queue_bytes);
  link.range_m = keys.range_m.value_or(link.range_m);
  for (const SpanKeys& outage : keys.outages) link.outages.push_back(outage.span());
  return link;
}

// True for a recording of Mahimahi, of either direction.
bool is_recording(const fs::path& file) {
  return file.extension() == ".up" || file.extension() == ".down";
}

// Every robot sends to those after it over the recorded uplink, and receives from them over the
// downlink.
std::vector<PairKeys> recorded_pairs(const std::vector<std::string>& team, fs::path recording) {
  const fs::path up = recording.replace_extension(".up"),
                 down = recording.replace_extension(".down");
  std::vector<PairKeys> pairs;
  const auto add = [&](const std::string& from, const std::string& to, const fs::path& packets) {
    pairs.push_back({.from = from, .to = to, .one_way = true, .link = {}});
    pairs.back().link.packets = packets;
  };
  for (std::size_t a = 0; a < team.size(); ++a)
    for (std::size_t b = a + 1; b < team.size(); ++b) {
      add(team[a], team[b], up);
      add(team[b], team[a], down);
    }
  return pairs;
}

LinkPartition partition_of(const LinksFile& file, const PartitionKeys& keys) {
  LinkPartition partition{keys.when.span(), std::vector<std::size_t>(file.team.size(), 0)};
  for (std::size_t group = 0; group < keys.groups.size(); ++group)
    for (const std::string& name : keys.groups[group])
      partition.group_of[*file.number_of(name)] = group + 1;
  return partition;
}

// The true positions of a robot over the time of its recording.
std::vector<PathPoint> path_of(const RobotPlan& robot, const std::string& file) {
  if (robot.truth.empty())
    throw ConfigError(file + ": range_m needs the true poses of " + robot.name +
                      ": give its truth in the team file, or --truth");
  const std::vector<StampedPose> poses = read_trajectory(robot.truth);
  const auto window = recorded_window(robot);
  const Stamp start = window ? window->from : poses.front().stamp;
  std::vector<PathPoint> path;
  path.reserve(poses.size());
  for (const StampedPose& pose : poses)
    path.push_back({seconds_between(start, pose.stamp), pose.T.translation()});
  return path;
}

LinkScript make_script(const LinksFile& keys, const TeamPlan& plan, const std::string& file) {
  LinkScript script;
  script.seed = keys.seed;
  script.robots = keys.team.size();
  std::vector<LinkKeys> links(script.robots * script.robots, keys.all);
  const auto change = [&](std::size_t from, std::size_t to, const LinkKeys& own) {
    LinkKeys& link = links[from * script.robots + to];
    link = merged(link, own);
  };
  for (const PairKeys& pair : keys.pairs) {
    const std::size_t from = *keys.number_of(pair.from), to = *keys.number_of(pair.to);
    change(from, to, pair.link);
    if (!pair.one_way) change(to, from, pair.link);
  }
  std::ranges::transform(links, std::back_inserter(script.links), plan_of);
  for (const PartitionKeys& partition : keys.partitions)
    script.partitions.push_back(partition_of(keys, partition));
  const auto has_range = [](const LinkPlan& link) { return std::isfinite(link.range_m); };
  if (!std::ranges::any_of(script.links, has_range)) return script;
  if (plan.rate == "max")
    throw ConfigError(file + ": range_m needs a run in real time: give a --rate that is not max");
  if (plan.rate != "auto") script.rate = std::strtod(plan.rate.c_str(), nullptr);
  for (const RobotPlan& robot : plan.robots) script.paths.push_back(path_of(robot, file));
  return script;
}

}  // namespace

std::optional<std::size_t> LinksFile::number_of(const std::string& robot) const {
  const auto found = std::ranges::find(team, robot);
  if (found == team.end()) return std::nullopt;
  return static_cast<std::size_t>(found - team.begin());
}

std::string LinksFile::problem_of(const std::vector<std::vector<std::string>>& groups) const {
  std::set<std::string> named;
  for (const auto& group : groups)
    for (const std::string& name : group) {
      if (!number_of(name)) return "name " + name + ", which is no robot of the team";
      if (!named.insert(name).second) return "name " + name + " twice";
    }
  return {};
}

LinkScript read_links_file(const fs::path& file, const TeamPlan& plan) {
  LinksFile keys;
  for (const RobotPlan& robot : plan.robots) keys.team.push_back(robot.name);
  if (is_recording(file)) {
    keys.pairs = recorded_pairs(keys.team, file);
    return make_script(keys, plan, file.string());
  }
  ConfigProblems problems;
  const ConfigContext context{problems, fs::absolute(file).parent_path()};
  fill_config(read_section(load_yaml(file), "", file.string(), context), "", context, keys);
  problems.finish();
  return make_script(keys, plan, file.string());
}

std::string links_file_keys() {
  return keys_of(LinksFile());
}

}  // namespace km
