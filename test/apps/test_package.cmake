# The Debian package: names, dependencies, and the files that only a package places.
#   cmake -DBUILD=<build folder> -P test_package.cmake
include(${BUILD}/CPackConfig.cmake)
function(check value expected)
  if(NOT "${value}" MATCHES "${expected}")
    message(FATAL_ERROR "'${value}' does not match '${expected}'")
  endif()
endfunction()
check("${CPACK_GENERATOR} ${CPACK_PACKAGE_NAME}" "^DEB kimera-multi$")
check("${CPACK_DEBIAN_PACKAGE_SHLIBDEPS} ${CPACK_PACKAGING_INSTALL_PREFIX}" "^ON /usr$")
check("${CPACK_COMPONENTS_ALL}" "^programs;package$")

set(root ${BUILD}/test_package)
file(REMOVE_RECURSE ${root})
execute_process(
  COMMAND ${CMAKE_COMMAND} --install ${BUILD} --component package --prefix ${root}
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(READ "${root}/lib/systemd/system/kimera_multi_robot@.service" unit)
check("${unit}" "ExecStart=/usr/bin/kimera_multi_robot ")
file(READ ${root}/share/doc/kimera-multi/examples/alice.env environment)
check("${environment}" "KM_RIG=/usr/share/kimera_multi/rigs/")
foreach(file share/bash-completion/completions/kimera_multi_team share/doc/kimera-multi/copyright
        share/doc/kimera-multi/README.md share/doc/kimera-multi/CHANGELOG.md
        share/man/man1/kimera_multi_robot.1)
  file(SIZE ${root}/${file} bytes)
endforeach()
file(READ ${root}/share/man/man1/kimera_multi_keys.1 page)
check("${page}" "\n.SH NAME\nkimera_multi_keys .- Keys of a team\n")
file(READ ${root}/share/man/man1/kimera_multi_pgo.1 page)
check("${page}" " in one process, or shows what keeps false loop closures out\n.SH")
