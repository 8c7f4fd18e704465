# Builds Tandem's packages and installs them: docker build -t tandem . && docker run --rm tandem estimate docking_a
FROM debian:trixie AS build
COPY . /tandem
RUN cd /tandem && scripts/package

FROM debian:trixie-slim
COPY --from=build /tandem/build/package/packages/tandem_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/tandem_*.deb && rm -rf /tmp/*.deb /var/lib/apt/lists/*
ENTRYPOINT ["tandem"]
