#include "modules/ros_dds/ros_sink.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "modules/core/io/write_file.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

McapSink::McapSink(std::filesystem::path file, std::function<void(const std::string&)> fail)
    : file_(std::move(file)), fail_(std::move(fail)) {}

std::size_t McapSink::open(const PublishedTopic& topic) {
  sequences_.push_back(0);
  return writer_.add_channel({.topic = topic.name, .message_encoding = "cdr"},
                             {.name = ros2_name(topic.type),
                              .encoding = "ros2msg",
                              .data = ros_definition(topic.type)}) -
         1U;
}

void McapSink::put(std::size_t topic, std::optional<Stamp> time,
                   std::span<const std::uint8_t> message) {
  if (failed_ || !time) return;
  newest_ = std::max(newest_, *time);
  writer_.add({.channel_id = static_cast<std::uint16_t>(topic + 1),
               .sequence = sequences_.at(topic)++,
               .log_time = *time,
               .publish_time = *time},
              message);
  write();
}

void McapSink::flush() {
  if (failed_) return;
  writer_.end_chunk();
  write();
}

void McapSink::attach(const std::string& name, std::string_view text) {
  if (failed_) return;
  writer_.attach({.log_time = newest_,
                  .create_time = newest_,
                  .name = name,
                  .media_type = "text/plain",
                  .data = {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}});
  write();
}

void McapSink::finish() {
  if (failed_) return;
  writer_.finish();
  write();
}

void McapSink::write() try {
  using std::filesystem::is_regular_file, std::filesystem::symlink_status;
  const auto bytes = writer_.take();
  if (bytes.empty()) return;
  std::string waiting(bytes.begin(), bytes.end());
  // A device, a pipe or a link is written in place.
  if (written_ == 0 && is_regular_file(symlink_status(file_))) std::filesystem::remove(file_);
  append_to_file(file_, waiting);
  written_ += bytes.size();
} catch (const std::exception& error) {
  failed_ = true;
  std::error_code unknown;
  std::filesystem::resize_file(file_, written_, unknown);  // removes an incomplete chunk
  fail_(error.what());
}

}  // namespace km
