# The installed files, and a Debian package for each of the four programs. `cpack` in the build folder (build/release) makes the
# packages. The command line and the worker depend on the package of the image decoder. The coordinator depends on no image
# library. With Debian's dependencies these take most of a farm's disk space.
#
# The programs look for each other and for the page in their own folder. So all of this is in lib/lightmill, and bin/ has links
# to it.
set(private lib/lightmill)
set(programs lightmill lightmill-server lightmill-worker)
foreach(program ${programs})
  install(TARGETS ${program} RUNTIME DESTINATION ${private} COMPONENT ${program})
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/links)
  file(CREATE_LINK ../${private}/${program} ${CMAKE_CURRENT_BINARY_DIR}/links/${program} SYMBOLIC)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/links/${program} DESTINATION bin COMPONENT ${program})
  foreach(file bash-completion/completions/${program} zsh/vendor-completions/_${program} fish/vendor_completions.d/${program}.fish
               man/man1/${program}.1.gz)
    get_filename_component(folder share/${file} DIRECTORY)
    install(FILES ${share}/${file} DESTINATION ${folder} COMPONENT ${program})
  endforeach()
  install(FILES debian/copyright DESTINATION share/doc/${program} COMPONENT ${program})
endforeach()

if(TARGET lightmill-web)
  install(DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/lightmill-web DESTINATION ${private} COMPONENT lightmill-server)
  # Not in share/doc, because slim images exclude it.
  foreach(library preact uplot)
    install(FILES ${PROJECT_SOURCE_DIR}/client/web/node_modules/${library}/LICENSE DESTINATION ${private}
            RENAME LICENSE.${library} COMPONENT lightmill-server)
  endforeach()
endif()
install(FILES systemd/lightmill-server.service DESTINATION lib/systemd/system COMPONENT lightmill-server)
install(FILES systemd/server.conf DESTINATION /etc/lightmill COMPONENT lightmill-server)

install(FILES systemd/lightmill-worker.service DESTINATION lib/systemd/system COMPONENT lightmill-worker)
install(FILES systemd/lightmill-worker.service DESTINATION lib/systemd/system RENAME lightmill-worker@.service COMPONENT lightmill-worker)
install(FILES systemd/worker.conf DESTINATION /etc/lightmill COMPONENT lightmill-worker)

# Without a link in bin/, because only the programs call it.
install(TARGETS lightmill-image-decoder RUNTIME DESTINATION ${private} COMPONENT lightmill-image-decoder)
install(FILES debian/copyright DESTINATION share/doc/lightmill-image-decoder COMPONENT lightmill-image-decoder)
install(DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/lightmill-blender DESTINATION ${private} COMPONENT lightmill)
file(GLOB scenes CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/scenes/*.json)
install(FILES ${scenes} DESTINATION share/lightmill/scenes COMPONENT lightmill)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/scenes/assets DESTINATION share/lightmill/scenes COMPONENT lightmill)
install(FILES ${PROJECT_SOURCE_DIR}/README.md DESTINATION share/doc/lightmill COMPONENT lightmill)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION share/doc/lightmill COMPONENT lightmill
        FILES_MATCHING PATTERN "*.md" PATTERN images EXCLUDE PATTERN gallery EXCLUDE PATTERN experiments EXCLUDE)
install(DIRECTORY slurm DESTINATION share/lightmill USE_SOURCE_PERMISSIONS COMPONENT lightmill)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lightmill)
set(CPACK_PACKAGE_CONTACT "Lightmill maintainers <root@localhost>")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)  # one package for each component
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(about "A coordinator splits a picture into tiles and sample ranges, and workers render
them. The picture improves while you watch. Its bits do not depend on how the
work was split.")
foreach(program ${programs} lightmill-image-decoder)
  string(TOUPPER ${program} name)
  set(CPACK_DEBIAN_${name}_PACKAGE_NAME ${program})
  set(scripts ${CMAKE_CURRENT_SOURCE_DIR}/debian/${program})
  if(EXISTS ${scripts})  # for programs with a service and a user
    set(CPACK_DEBIAN_${name}_PACKAGE_DEPENDS adduser)
    set(CPACK_DEBIAN_${name}_PACKAGE_CONTROL_EXTRA ${scripts}/conffiles ${scripts}/postinst ${scripts}/prerm ${scripts}/postrm)
  endif()
endforeach()
set(decoder "lightmill-image-decoder (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_LIGHTMILL_PACKAGE_DEPENDS "${decoder}")
set(CPACK_DEBIAN_LIGHTMILL-WORKER_PACKAGE_DEPENDS "adduser, ${decoder}")
set(CPACK_DEBIAN_LIGHTMILL-SERVER_DESCRIPTION "render farm: the coordinator and its web page
${about} This package has the coordinator and the web
page. It does not start the coordinator.")
set(CPACK_DEBIAN_LIGHTMILL-WORKER_DESCRIPTION "render farm: the worker
${about} This package has the worker. A farm can have any
number of workers. The package starts none.")
set(CPACK_DEBIAN_LIGHTMILL-IMAGE-DECODER_DESCRIPTION "render farm: image decoder in a sandbox
${about} This package has the program that decodes images
and compressed meshes of scenes for the command line and the worker.")
set(CPACK_DEBIAN_LIGHTMILL_DESCRIPTION "render farm: the command line
${about} This package has the command line, scenes and
scripts for Slurm. With the packages of coordinator and worker it also renders
without a farm.")
set(CPACK_DEBIAN_LIGHTMILL_PACKAGE_SUGGESTS "lightmill-server, lightmill-worker")
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON)  # otherwise files for /etc would go to /etc of the build machine
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_THREADS 2)
include(CPack)
