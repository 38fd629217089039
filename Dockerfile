# The program in a container, docs/dependencies.md:
#   docker build -t tiltrim .
#   docker run --rm -v "$PWD:/work" --user "$(id -u):$(id -g)" tiltrim trim study.toml
FROM debian:12-slim AS build
COPY cmake/install-packages.sh /source/cmake/install-packages.sh
RUN /source/cmake/install-packages.sh && rm -rf /var/lib/apt/lists/*
COPY . /source
WORKDIR /source
RUN cmake --preset release -D TILTRIM_TESTS=OFF \
 && cmake --build --preset release -j "$(nproc)" \
 && cpack --config build/CPackConfig.cmake

FROM debian:12-slim
COPY --from=build /source/build/package/tiltrim_*.deb /tmp/
RUN apt-get update -q \
 && DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends /tmp/tiltrim_*.deb gnuplot-nox \
 && rm -rf /tmp/tiltrim_*.deb /var/lib/apt/lists/* \
 && useradd --create-home tiltrim
USER tiltrim
WORKDIR /work
ENTRYPOINT ["tiltrim"]
CMD ["--help"]
