# What is installed and packaged: program, library, headers, scenes, package files for CMake and pkg-config,
# man pages where help2man is, completion for bash.

include(CMakePackageConfigHelpers)

install(TARGETS nmm)
install(TARGETS nmm_library EXPORT nmm_targets)
install(FILES ${PROJECT_SOURCE_DIR}/include/nmm/nmm.h ${PROJECT_SOURCE_DIR}/include/nmm/study.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nmm)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
  ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
# Scenes of `nmm bench`, which looks for them there.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/paper
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/nmm/examples FILES_MATCHING PATTERN scene.yaml)
install(FILES ${PROJECT_SOURCE_DIR}/src/cli/completion.bash RENAME nmm
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions)

# find_package(nmm) gives nmm::nmm.
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/nmm)
install(EXPORT nmm_targets NAMESPACE nmm:: FILE nmmConfig.cmake DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/nmmConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nmmConfigVersion.cmake DESTINATION ${package_folder})

# Every path is relative to the file itself, so that the installed folder may be moved.
file(RELATIVE_PATH nmm_prefix_from_pc
  ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
file(RELATIVE_PATH nmm_include_from_prefix
  ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_INCLUDEDIR})
file(RELATIVE_PATH nmm_library_from_prefix ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_LIBDIR})
configure_file(${PROJECT_SOURCE_DIR}/cmake/nmm.pc.in ${PROJECT_BINARY_DIR}/nmm.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/nmm.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# Man page from --help.
find_program(HELP2MAN help2man)
if(HELP2MAN AND NOT NMM_SANITIZE)
  add_custom_command(OUTPUT nmm.1
    COMMAND ${HELP2MAN} --no-info --name "numerical manifold method in 2-D" -o nmm.1
      $<TARGET_FILE:nmm>
    DEPENDS nmm WORKING_DIRECTORY ${PROJECT_BINARY_DIR} VERBATIM)
  add_custom_target(nmm_manual ALL DEPENDS nmm.1)
  install(FILES ${PROJECT_BINARY_DIR}/nmm.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endif()

# A Debian package that names the libraries it needs: cpack -G DEB.
set(CPACK_PACKAGE_CONTACT "nmm developers")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "numerical manifold method in 2-D")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS fonts-dejavu-core)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
include(CPack)
