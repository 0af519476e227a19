# The program `trace` with all that ships, on Debian 12; without `train`, which needs libtorch.
#
#   docker build -t furrow:0.1.0 .
#   docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" furrow:0.1.0 --scene field --spp 16
#
# Needs BuildKit, which Docker 23 and later use by default; before: DOCKER_BUILDKIT=1. Where Docker Hub is not reachable, --build-arg RUST=…
# and --build-arg DEBIAN=… name other images of Rust 1.89 or newer on Debian 12, and of Debian 12.
# `trace dataset emit --scheduler kubernetes` names this image unless --image says another.
ARG RUST=rust:1.89-bookworm
ARG DEBIAN=debian:bookworm-slim

FROM ${RUST} AS build
RUN apt-get update && apt-get install -y --no-install-recommends libembree-dev && rm -rf /var/lib/apt/lists/*
WORKDIR /src
# What cargo reads: a change of a scene file or of a page compiles nothing again. Cargo asks for the files of all tests, benches and examples.
COPY Cargo.toml Cargo.lock ./
COPY .cargo/ .cargo/
COPY build/ build/
COPY crates/ crates/
COPY src/ src/
COPY benches/ benches/
COPY examples/ examples/
COPY tests/ tests/
# Downloads and compiled crates stay in BuildKit's cache: after a change of the source, only what depends on it is compiled.
RUN --mount=type=cache,target=/usr/local/cargo/registry --mount=type=cache,target=/src/target \
    cargo build --release --locked --bin trace && strip -o /usr/local/bin/trace target/release/trace

FROM ${DEBIAN}
RUN apt-get update && apt-get install -y --no-install-recommends libembree3-3 && rm -rf /var/lib/apt/lists/*
COPY --from=build /usr/local/bin/trace /usr/local/bin/
COPY scenes/ /usr/local/share/furrow/scenes/
COPY textures/ /usr/local/share/furrow/textures/
WORKDIR /work
ENTRYPOINT ["trace"]
CMD ["--help"]
