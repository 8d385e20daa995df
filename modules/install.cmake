# cmake --install: the programs (component `programs`) and the modules below as libraries (component
# `library`). Users say find_package(kimera_multi) and link kimera_multi::<module>; apps/examples
# shows it. Include paths are those of the tree: "modules/vio/vio.hpp".
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME library)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/kimera_multi)

set(modules core images vio_frontend vio place_recognition loop_closure outlier_rejection pose_graph
  recorded_graph mesh semantic_mapping mesh_deformation recordings sensors)
# sensors_node reads calibrations; the others are its libraries.
set(KM_EXPORTED ${modules} sensors_node runtime security idl opencv)
list(TRANSFORM KM_EXPORTED PREPEND km_ OUTPUT_VARIABLE targets)
foreach(name ${KM_EXPORTED})
  set_target_properties(km_${name} PROPERTIES EXPORT_NAME ${name})
endforeach()
install(TARGETS ${targets} EXPORT kimera_multiTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT kimera_multiTargets NAMESPACE kimera_multi:: DESTINATION ${config_dir})

# Headers with threads or network include those of runtime/, and are not installed.
foreach(module ${modules})
  file(GLOB module_headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} modules/${module}/*.hpp)
  foreach(header ${module_headers})
    file(STRINGS ${header} of_runtime REGEX "^#include \"runtime/")
    if(NOT of_runtime)
      install(FILES ${header} DESTINATION include/kimera_multi/modules/${module})
    endif()
  endforeach()
endforeach()

configure_package_config_file(modules/kimera_multiConfig.cmake.in kimera_multiConfig.cmake
  INSTALL_DESTINATION ${config_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(kimera_multiConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kimera_multiConfig.cmake
  ${PROJECT_BINARY_DIR}/kimera_multiConfigVersion.cmake DESTINATION ${config_dir})

install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

get_property(programs GLOBAL PROPERTY KM_PROGRAMS)
install(TARGETS ${programs} RUNTIME COMPONENT programs)
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/kimera_multi COMPONENT programs
  PATTERN docker EXCLUDE PATTERN install_packages EXCLUDE PATTERN packages.txt EXCLUDE)
