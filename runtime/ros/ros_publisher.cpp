#include "runtime/ros/ros_publisher.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace km {
namespace {

// DDS gives access to the type that it makes of a descriptor only through a received message. So
// a message without content is sent over a topic that no other participant uses.
ddsi_serdata* receive_blank(const RosNetwork& network, std::string_view type) {
  const dds_topic_descriptor_t& descriptor = RosNetwork::descriptor_of(type);
  std::string name = "kimera_multi/type/" + std::string(descriptor.m_typename);
  std::ranges::replace(name, ':', '_');
  const DdsEntity topic(
      dds_create_topic(network.participant(), &descriptor, name.c_str(), nullptr, nullptr),
      "topic " + name);
  const DdsEntity reader(dds_create_reader(network.participant(), topic.handle(), nullptr, nullptr),
                         "reader of " + name);
  const DdsEntity writer(dds_create_writer(network.participant(), topic.handle(), nullptr, nullptr),
                         "writer of " + name);
  const std::vector<std::byte> blank(descriptor.m_size);
  check_dds(dds_write(writer.handle(), blank.data()), "cannot write on " + name);
  ddsi_serdata* received = nullptr;
  dds_sample_info_t info;
  if (check_dds(dds_takecdr(reader.handle(), &received, 1, &info, DDS_ANY_STATE),
                "cannot read from " + name) != 1)
    throw DdsError("no message came over " + name);
  return received;
}

}  // namespace

void SerializedDeleter::operator()(ddsi_serdata* serialized) const {
  ddsi_serdata_unref(serialized);
}

RosPublisher::RosPublisher(std::shared_ptr<const RosNetwork> network, const std::string& topic,
                           std::string_view type, RosQos qos, int depth)
    : network_(std::move(network)),
      name_(topic),
      topic_(network_->create_topic(topic, type)),
      writer_(dds_create_writer(network_->participant(), topic_.handle(), ros_qos(qos, depth).get(),
                                nullptr),
              "writer of " + topic),
      blank_(receive_blank(*network_, type)) {}

void RosPublisher::publish(std::span<const std::uint8_t> bytes) const {
  std::vector<std::uint8_t> padded(bytes.begin(), bytes.end());
  padded.resize((padded.size() + 3) / 4 * 4);  // DDS pads to 4 bytes on the wire
  ddsrt_iovec_t vector{.iov_base = padded.data(),
                       .iov_len = static_cast<ddsrt_iov_len_t>(padded.size())};
  ddsi_serdata* const sample =
      ddsi_serdata_from_ser_iov(blank_->type, SDK_DATA, 1, &vector, padded.size());
  if (sample == nullptr) throw DdsError("not a message of the type of " + name_);
  check_dds(dds_writecdr(writer_.handle(), sample), "cannot publish on " + name_);
}

std::size_t RosPublisher::reader_count() const {
  dds_publication_matched_status_t status{};
  check_dds(dds_get_publication_matched_status(writer_.handle(), &status),
            "cannot count the readers of " + name_);
  return status.current_count;
}

}  // namespace km
