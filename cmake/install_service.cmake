# rcsplat as a studio runs it: components service (the program), systemd (unit, configuration, user) and protos.
install(TARGETS rcsplat COMPONENT service)
install(CODE "set(source \"${CMAKE_CURRENT_SOURCE_DIR}/systemd\")
set(made \"${CMAKE_CURRENT_BINARY_DIR}\")
set(bin \"${CMAKE_INSTALL_BINDIR}\")
set(sysconf \"${CMAKE_INSTALL_SYSCONFDIR}\")
include(\"${CMAKE_CURRENT_SOURCE_DIR}/systemd/install.cmake\")" COMPONENT systemd)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/proto/rcs/v1 DESTINATION ${CMAKE_INSTALL_DATADIR}/rcsplat/proto/rcs COMPONENT protos
    FILES_MATCHING PATTERN *.proto)
install(DIRECTORY ${rcsplat_share}/bash-completion ${rcsplat_share}/zsh ${rcsplat_share}/fish ${rcsplat_share}/man
    DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT service)
