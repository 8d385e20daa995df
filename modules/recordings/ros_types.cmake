# Writes the C++ types of ROS messages and their definitions (.msg) from idl/ros2.idl, the only place
# that defines them. The rows below map the basic types.
set(types  # IDL, C++, .msg
  "octet std::uint8_t uint8" "byte std::uint8_t byte" "int8 std::int8_t int8" "boolean bool bool"
  "unsigned_short std::uint16_t uint16" "unsigned_long std::uint32_t uint32" "long std::int32_t int32"
  "float float float32" "double double float64" "string std::string string"
  "Time Stamp builtin_interfaces/Time" "Vector3 Eigen::Vector3d geometry_msgs/Vector3"
  "Point Eigen::Vector3d geometry_msgs/Point" "Quaternion Eigen::Quaterniond geometry_msgs/Quaternion"
  "ColorRGBA Eigen::Vector4f std_msgs/ColorRGBA")
foreach(row ${types})
  string(REPLACE " " ";" row ${row})
  list(GET row 0 name)
  list(GET row 1 cpp_${name})
  list(GET row 2 msg_${name})
endforeach()
foreach(name Vector3 Point)
  set(default_${name} "Eigen::Vector3d::Zero()")
endforeach()
set(default_Quaternion "Eigen::Quaterniond::Identity()")
set(default_ColorRGBA "Eigen::Vector4f::Zero()")
set(is_native Time Vector3 Point Quaternion ColorRGBA)

set(idl ${PROJECT_SOURCE_DIR}/idl/ros2.idl)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${idl})
file(READ ${idl} text)
string(REGEX REPLACE "//[^\n]*" "" text "${text}")
string(REGEX REPLACE "unsigned (long|short)" "unsigned_\\1" text "${text}")
string(REGEX REPLACE "[a-z0-9_]+::msg::dds_::" "" text "${text}")
string(REPLACE ";" "|" text "${text}")  # ";" separates the elements of CMake's lists
string(REGEX MATCHALL "module [a-z0-9_]+ { module msg|struct [A-Za-z0-9]+_ {[^}]*}" items "${text}")
set(structs "")
set(definitions "")
foreach(item ${items})
  if(item MATCHES "^module ([a-z0-9_]+)")
    set(package ${CMAKE_MATCH_1})
    continue()
  endif()
  string(REGEX MATCH "^struct ([A-Za-z0-9]+)_ {([^}]*)}" item "${item}")
  set(name ${CMAKE_MATCH_1})
  set(type ${package}/${name})
  string(REGEX REPLACE "[ \n]+" " " members "${CMAKE_MATCH_2}")
  string(REPLACE "|" ";" members "${members}")
  set(cpp_members "")
  set(names "")
  set(msg_members "")
  foreach(member ${members})
    if(member MATCHES "^ ?$")
      continue()  # behind the last field
    endif()
    if(NOT member MATCHES "^ ?(sequence<)?([A-Za-z0-9_]+[a-zA-Z0-9])_?>? ([a-z0-9_]+)(\\[([0-9]+)\\])?$")
      message(FATAL_ERROR "${idl}: the field '${member}' of ${type} is of no known form")
    endif()
    set(sequence "${CMAKE_MATCH_1}")
    set(of ${CMAKE_MATCH_2})
    set(field ${CMAKE_MATCH_3})
    set(count "${CMAKE_MATCH_5}")
    if(NOT DEFINED cpp_${of})
      message(FATAL_ERROR "${idl}: the field '${member}' of ${type} is of no known type")
    endif()
    set(cpp ${cpp_${of}})
    set(default "${default_${of}}")
    if(sequence)
      string(REPLACE "::int8_t" "::uint8_t" cpp "${cpp}")  # bytes
      set(cpp "std::vector<${cpp}>")
      set(default "{}")
      string(APPEND msg_members "${msg_${of}}[] ${field}\\n")
    elseif(count)
      set(cpp "std::array<${cpp}, ${count}>")
      set(default "{}")
      string(APPEND msg_members "${msg_${of}}[${count}] ${field}\\n")
    else()
      string(APPEND msg_members "${msg_${of}} ${field}\\n")
    endif()
    if(default STREQUAL "")
      set(default "{}")
    endif()
    string(APPEND cpp_members "  ${cpp} ${field} = ${default}[sep]\n")
    list(APPEND names "m.${field}")
  endforeach()
  string(APPEND definitions "    {\"${type}\", \"${msg_members}\"},\n")
  set(msg_${name} ${type})
  if(NOT name IN_LIST is_native)
    set(cpp_${name} Ros${name})
    list(JOIN names ", " names)
    string(APPEND structs "struct Ros${name} {
  static constexpr std::string_view kType = \"${type}\"[sep]
${cpp_members}
  static void visit(auto& wire, auto& m) { wire(${names})[sep] }
}[sep]

")
  endif()
endforeach()
string(REPLACE "[sep]" ";" structs "${structs}")
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/modules/recordings/ros_types.hpp CONTENT [[
// Written by modules/recordings/ros_types.cmake from idl/ros2.idl.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

@structs@struct RosDefinition {
  std::string_view type, fields;
};
inline constexpr RosDefinition kRosDefinitions[] = {
@definitions@};

}  // namespace km
]] @ONLY NEWLINE_STYLE UNIX)
