#include "runtime/ros/ros_network.hpp"

#include <ros2.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "modules/core/io/text_rows.hpp"
#include "modules/core/io/xml_text.hpp"
#include "runtime/dds/participant.hpp"

namespace km {
namespace {

struct KnownType {
  const char* package;
  const char* name;
  const dds_topic_descriptor_t* descriptor;
};

constexpr std::array<KnownType, 16> kTypes = {{
    {"sensor_msgs", "Image", &sensor_msgs_msg_dds__Image__desc},
    {"sensor_msgs", "CompressedImage", &sensor_msgs_msg_dds__CompressedImage__desc},
    {"sensor_msgs", "Imu", &sensor_msgs_msg_dds__Imu__desc},
    {"sensor_msgs", "CameraInfo", &sensor_msgs_msg_dds__CameraInfo__desc},
    {"sensor_msgs", "NavSatFix", &sensor_msgs_msg_dds__NavSatFix__desc},
    {"geometry_msgs", "TransformStamped", &geometry_msgs_msg_dds__TransformStamped__desc},
    {"geometry_msgs", "PoseStamped", &geometry_msgs_msg_dds__PoseStamped__desc},
    {"geometry_msgs", "PoseWithCovarianceStamped",
     &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc},
    {"nav_msgs", "Odometry", &nav_msgs_msg_dds__Odometry__desc},
    {"nav_msgs", "Path", &nav_msgs_msg_dds__Path__desc},
    {"nav_msgs", "OccupancyGrid", &nav_msgs_msg_dds__OccupancyGrid__desc},
    {"sensor_msgs", "PointCloud2", &sensor_msgs_msg_dds__PointCloud2__desc},
    {"diagnostic_msgs", "DiagnosticArray", &diagnostic_msgs_msg_dds__DiagnosticArray__desc},
    {"tf2_msgs", "TFMessage", &tf2_msgs_msg_dds__TFMessage__desc},
    {"visualization_msgs", "Marker", &visualization_msgs_msg_dds__Marker__desc},
    {"visualization_msgs", "MarkerArray", &visualization_msgs_msg_dds__MarkerArray__desc},
}};

// DDS has one configuration per domain number and process. So ROS' domain gets another number
// inside this process, beyond those on the network, and its true number on the network.
constexpr dds_domainid_t kOwnNumbers = 1000;

// Buffer for images that arrive faster than they are read. The kernel may grant less:
// net.core.rmem_max.
constexpr int kReceiveBuffer_bytes = 32 << 20;

std::string cyclone_xml(const RosConfig& config, const NetworkInterface& interface) {
  std::string peers;
  for (const std::string& peer : config.peers)
    peers += "<Peer address='" + xml_escaped(peer) + "'/>";
  if (!peers.empty()) peers = "<Peers>" + peers + "</Peers>";
  return "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface name='" +
         xml_escaped(interface.name) + '\'' + (interface.loopback ? " multicast='true'" : "") +
         "/></Interfaces></General><Discovery><ExternalDomainId>" + std::to_string(config.domain) +
         "</ExternalDomainId><ParticipantIndex>" + (peers.empty() ? "none" : "auto") +
         "</ParticipantIndex>" + peers + "</Discovery><Internal><SocketReceiveBufferSize max='" +
         std::to_string(kReceiveBuffer_bytes) + "B'/>" + kOneReceiveThread +
         "</Internal></Domain></CycloneDDS>";
}

}  // namespace

RosNetwork::RosNetwork(const RosConfig& config) : ros_domain_(config.domain) {
  check_hosts(checked(config).peers);
  const NetworkInterface interface = select_interface(network_interfaces(), config.interface);
  interface_ = interface.name;
  const auto number = kOwnNumbers + static_cast<dds_domainid_t>(config.domain);
  domain_ =
      DdsEntity(dds_create_domain(number, cyclone_xml(config, interface).c_str()),
                "domain " + std::to_string(config.domain) + " of ROS on interface " + interface_);
  participant_ = DdsEntity(dds_create_participant(number, nullptr, nullptr),
                           "participant in the domain of ROS");
}

const dds_topic_descriptor_t& RosNetwork::descriptor_of(std::string_view type) {
  const auto known = std::ranges::find_if(kTypes, [type](const KnownType& candidate) {
    const std::string package(candidate.package), name(candidate.name);
    return type == package + '/' + name || type == package + "/msg/" + name;
  });
  if (known == kTypes.end())
    throw std::invalid_argument("messages of " + readable(std::string(type), 80) +
                                " have an unknown type");
  return *known->descriptor;
}

DdsEntity RosNetwork::create_topic(std::string_view topic, std::string_view type) const {
  const std::string name = "rt/" + std::string(topic.substr(topic.starts_with('/') ? 1 : 0));
  return {dds_create_topic(participant(), &descriptor_of(type), name.c_str(), nullptr, nullptr),
          "topic " + name};
}

std::vector<std::string> known_ros_types() {
  std::vector<std::string> names;
  for (const KnownType& type : kTypes)
    names.push_back(std::string(type.package) + "/msg/" + type.name);
  return names;
}

DdsQos ros_qos(RosQos kind, int depth) {
  DdsQos qos = make_dds_qos();
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  const bool is_reliable = kind != RosQos::kSensorData;
  dds_qset_reliability(qos.get(),
                       is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(100));
  dds_qset_durability(qos.get(), kind == RosQos::kLatched ? DDS_DURABILITY_TRANSIENT_LOCAL
                                                          : DDS_DURABILITY_VOLATILE);
  if (kind == RosQos::kLatched)  // otherwise DDS keeps one message for late readers
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return qos;
}

}  // namespace km
