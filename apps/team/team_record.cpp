#include "apps/team/team_record.hpp"

#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "apps/result_files.hpp"
#include "modules/recordings/mcap_reader.hpp"
#include "modules/recordings/merged_reader.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/mcap_sink.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

RosTFMessage root_transform(const std::string& root, Stamp stamp) {
  return {{{{stamp, "map"}, ros_name(root) + "/map", {}}}};
}

}  // namespace

std::vector<fs::path> robot_records(const fs::path& folder) {
  std::vector<fs::path> records;
  fs::path file = folder / kRecord;
  for (int number = 2; fs::exists(file); ++number) {
    records.push_back(file);
    file = numbered(folder / kRecord, number);
  }
  return records;
}

void merge_records(std::span<const fs::path> records, const std::string& root,
                   const fs::path& file) {
  std::vector<std::unique_ptr<BagReader>> readers;
  for (const fs::path& record : records) readers.push_back(std::make_unique<McapReader>(record));
  MergedReader merged(std::move(readers));
  std::optional<std::string> failure;
  McapSink sink(file, [&failure](const std::string& why) { failure = why; });
  const std::size_t statics = sink.open({"/tf_static", RosTFMessage::kType, true, 1});
  std::vector<std::size_t> topics;
  bool begun = root.empty();
  while (const auto message = merged.next()) {
    for (std::size_t k = topics.size(); k < merged.channels().size(); ++k)
      topics.push_back(
          sink.open({merged.channels()[k].topic, ros1_name(merged.channels()[k].type)}));
    if (!std::exchange(begun, true))
      sink.put(statics, message->log_time, encode_ros(root_transform(root, message->log_time)));
    sink.put(topics[message->channel], message->log_time, message->bytes);
    if (failure) break;
  }
  for (const fs::path& record : records)
    for (const auto& [name, text] : read_mcap_attachments(record))
      sink.attach(record.parent_path().filename().string() + '/' + name, text);
  sink.finish();
  if (failure) throw std::runtime_error(*failure);
}

}  // namespace km
