# cmake --install: the programs (component `programs`) and the modules below as libraries (component
# `library`). Users say find_package(kimera_multi) and link kimera_multi::<module>; apps/examples
# shows it. Include paths are those of the tree: "modules/vio/vio.hpp".
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME library)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/kimera_multi)

set(modules core images vio_frontend vio place_recognition loop_closure outlier_rejection tree_newton robust session
  rbcd recorded_graph mesh semantic_mapping mesh_deformation team_map recordings sensors charts evaluation)
# sensors_node reads calibrations, program and heap are parts of every program. The others are libraries of these.
set(KM_EXPORTED ${modules} sensors_node program heap runtime security idl opencv chart_files)
list(TRANSFORM KM_EXPORTED PREPEND km_ OUTPUT_VARIABLE targets)
foreach(name ${KM_EXPORTED})
  set_target_properties(km_${name} PROPERTIES EXPORT_NAME ${name})
  add_library(kimera_multi::${name} ALIAS km_${name})
endforeach()
install(TARGETS ${targets} EXPORT kimera_multiTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  OBJECTS DESTINATION ${CMAKE_INSTALL_LIBDIR}/kimera_multi)
install(EXPORT kimera_multiTargets NAMESPACE kimera_multi:: DESTINATION ${config_dir})

# Headers with threads or network include those of runtime/, and are not installed. The headers
# below are those of the runtime and the programs that have a use outside robots.
foreach(module ${modules} core/io core/geometry core/camera core/map core/data)
  file(GLOB module_headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} modules/${module}/*.hpp
       modules/${module}/node/*.hpp)
  foreach(header ${module_headers})
    file(STRINGS ${header} of_runtime REGEX "^#include \"runtime/")
    if(NOT of_runtime)
      get_filename_component(folder ${header} DIRECTORY)
      install(FILES ${header} DESTINATION include/kimera_multi/${folder})
    endif()
  endforeach()
endforeach()
foreach(header apps/output_file.hpp apps/program_options.hpp apps/program_version.hpp
               apps/stage_progress.hpp
               runtime/clock.hpp runtime/config_layers.hpp runtime/config_text.hpp
               runtime/signal_watch.hpp runtime/yaml_config.hpp)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION include/kimera_multi/${folder})
endforeach()

configure_package_config_file(modules/kimera_multiConfig.cmake.in kimera_multiConfig.cmake
  INSTALL_DESTINATION ${config_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(kimera_multiConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kimera_multiConfig.cmake
  ${PROJECT_BINARY_DIR}/kimera_multiConfigVersion.cmake DESTINATION ${config_dir})

install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

get_property(programs GLOBAL PROPERTY KM_PROGRAMS)
add_custom_target(programs DEPENDS ${programs})
install(TARGETS ${programs} RUNTIME COMPONENT programs)
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/kimera_multi COMPONENT programs
  PATTERN docker EXCLUDE PATTERN Doxyfile EXCLUDE PATTERN install_packages EXCLUDE PATTERN packages.txt EXCLUDE)
