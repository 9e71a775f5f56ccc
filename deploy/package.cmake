# What is installed, and the Debian package of it: `cpack` in the build folder (build/release) makes it.
#
# The programs find each other, what reads images and the page beside themselves, so all of that lies in lib/lightmill, and
# bin/ has links to it.
set(private lib/lightmill)
set(programs lightmill lightmill-server lightmill-worker)
install(TARGETS ${programs} RUNTIME DESTINATION ${private})
install(TARGETS lightmill-images LIBRARY DESTINATION ${private})
foreach(program ${programs})
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/links)
  file(CREATE_LINK ../${private}/${program} ${CMAKE_CURRENT_BINARY_DIR}/links/${program} SYMBOLIC)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/links/${program} DESTINATION bin)
endforeach()
if(TARGET lightmill-web)
  install(DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/lightmill-web DESTINATION ${private})
  foreach(library preact uplot)
    install(FILES ${PROJECT_SOURCE_DIR}/client/web/node_modules/${library}/LICENSE DESTINATION share/doc/lightmill
            RENAME LICENSE.${library})
  endforeach()
endif()

install(DIRECTORY ${share}/bash-completion ${share}/zsh ${share}/fish DESTINATION share)
install(DIRECTORY ${share}/man DESTINATION share FILES_MATCHING PATTERN "*.1.gz")
file(GLOB scenes CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/scenes/*.json)
install(FILES ${scenes} DESTINATION share/lightmill/scenes)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/scenes/assets DESTINATION share/lightmill/scenes)
file(GLOB documents CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/*.md)
install(FILES ${PROJECT_SOURCE_DIR}/README.md DESTINATION share/doc/lightmill)
install(FILES ${documents} DESTINATION share/doc/lightmill/docs)
install(FILES debian/copyright DESTINATION share/doc/lightmill)

install(DIRECTORY slurm DESTINATION share/lightmill USE_SOURCE_PERMISSIONS)
install(FILES systemd/lightmill-server.service systemd/lightmill-worker.service DESTINATION lib/systemd/system)
install(FILES systemd/lightmill-worker.service DESTINATION lib/systemd/system RENAME lightmill-worker@.service)
install(FILES systemd/server.conf systemd/worker.conf DESTINATION /etc/lightmill)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lightmill)
set(CPACK_PACKAGE_CONTACT "Lightmill maintainers <root@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "render farm: one picture on many machines")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
    "A coordinator cuts a scene into tiles and sample ranges, workers render them,
and the picture grows in front of you. To the last bit it is the same however
the work was split. This package has the coordinator (lightmill-server), the
worker (lightmill-worker), the command line (lightmill) and the web page;
nothing of it is started before you say so.")
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    ${CMAKE_CURRENT_SOURCE_DIR}/debian/conffiles ${CMAKE_CURRENT_SOURCE_DIR}/debian/postinst
    ${CMAKE_CURRENT_SOURCE_DIR}/debian/prerm ${CMAKE_CURRENT_SOURCE_DIR}/debian/postrm)
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON)  # without it what goes to /etc would go to this machine's
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_THREADS 2)
include(CPack)
