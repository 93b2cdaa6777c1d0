# What `cmake --install` leaves behind: the library, include/burin/*.h, the CMake package, burin.pc, the licence, and
# the command line when it is built. The package is relocatable: nothing in it holds an absolute path.
include(CMakePackageConfigHelpers)

# Whether Burin is installed when it is part of a larger build is for that build to say.
option(BURIN_INSTALL "Add the install rules" ${PROJECT_IS_TOP_LEVEL})
if(NOT BURIN_INSTALL)
  return()
endif()

set(burin_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/burin)
set(burin_libraries burin)
if(TARGET burin_capture)
  list(APPEND burin_libraries burin_capture)
  # What a program has to link beside the static form; the shared one brings its own.
  get_property(burin_capture_names GLOBAL PROPERTY BURIN_CAPTURE_LINK_NAMES)
  if(NOT BUILD_SHARED_LIBS)
    foreach(name IN LISTS burin_capture_names)
      target_link_libraries(burin_capture INTERFACE $<INSTALL_INTERFACE:${name}>)
    endforeach()
  endif()
endif()
install(TARGETS ${burin_libraries} EXPORT burinTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR}
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/burin DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(TARGET burin_cli)
  install(TARGETS burin_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

install(EXPORT burinTargets NAMESPACE burin:: DESTINATION ${burin_cmake_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/burinConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/burinConfig.cmake INSTALL_DESTINATION ${burin_cmake_dir})
# Below 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/burinConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/burinConfig.cmake ${PROJECT_BINARY_DIR}/burinConfigVersion.cmake
        DESTINATION ${burin_cmake_dir})

# burin.pc finds its prefix from its own place, so it too may be moved. A C program that links the static form needs
# the C++ library and threads; with the shared form those are the library's own business.
cmake_path(SET pc_dir NORMALIZE ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
if(IS_ABSOLUTE ${CMAKE_INSTALL_LIBDIR} OR IS_ABSOLUTE ${CMAKE_INSTALL_INCLUDEDIR})
  set(BURIN_PC_PREFIX ${CMAKE_INSTALL_PREFIX})
  set(BURIN_PC_LIBDIR ${CMAKE_INSTALL_FULL_LIBDIR})
  set(BURIN_PC_INCLUDEDIR ${CMAKE_INSTALL_FULL_INCLUDEDIR})
else()
  file(RELATIVE_PATH up /${pc_dir} /)
  string(REGEX REPLACE "/$" "" up "${up}")
  set(BURIN_PC_PREFIX "\${pcfiledir}/${up}")
  set(BURIN_PC_LIBDIR "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
  set(BURIN_PC_INCLUDEDIR "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
set(BURIN_PC_LIBS "-lburin")
if(NOT BUILD_SHARED_LIBS)
  foreach(library IN LISTS BURIN_CXX_LIBRARIES)
    string(APPEND BURIN_PC_LIBS " -l${library}")
  endforeach()
  if(NOT BURIN_SCALAR_ONLY)
    string(APPEND BURIN_PC_LIBS " -lhwy")
  endif()
  string(APPEND BURIN_PC_LIBS " -pthread")
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/burin.pc.in ${PROJECT_BINARY_DIR}/burin.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/burin.pc DESTINATION ${pc_dir})
if(TARGET burin_capture)
  set(BURIN_CAPTURE_PC_LIBS "-lburin_capture")
  if(NOT BUILD_SHARED_LIBS)
    foreach(name IN LISTS burin_capture_names)
      string(APPEND BURIN_CAPTURE_PC_LIBS " -l${name}")
    endforeach()
  endif()
  configure_file(${CMAKE_CURRENT_LIST_DIR}/burin_capture.pc.in ${PROJECT_BINARY_DIR}/burin_capture.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/burin_capture.pc DESTINATION ${pc_dir})
endif()
