# Waydrop as a container: the page and the MAVLink dialect are built, then a wheel with them, then only what runs.
# The bases are arguments, so that an image of one's own can be used where no registry can be reached.
ARG NODE_IMAGE=docker.io/library/node:22-bookworm-slim
ARG PYTHON_IMAGE=docker.io/library/python:3.11-slim-bookworm

FROM ${NODE_IMAGE} AS page
# where packages come from is the environment's choice; these are not kept in the image
ARG NPM_CONFIG_REGISTRY
ARG NODE_EXTRA_CA_CERTS
WORKDIR /src/web
COPY web/package.json web/package-lock.json web/.npmrc ./
RUN npm ci
COPY web ./
RUN npm run build

FROM ${PYTHON_IMAGE} AS wheel
ARG PIP_INDEX_URL
ARG PIP_CERT
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /src
# requirements-cluster.txt: with what gateways and API nodes of a cluster need
ARG REQUIREMENTS=requirements.txt
COPY requirements-build.txt ${REQUIREMENTS} ./
RUN python3 -m venv /build && /build/bin/pip install --quiet --require-hashes -r requirements-build.txt \
 && python3 -m venv /opt/waydrop && /opt/waydrop/bin/pip install --quiet --require-hashes -r ${REQUIREMENTS}
COPY pyproject.toml hatch_build.py README.md CHANGELOG.md LICENSE ./
COPY app app
COPY --from=page /src/web/dist web/dist
RUN /opt/waydrop/bin/python -m app.simulator.dialect_build \
 && /build/bin/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir /wheels . \
 && /opt/waydrop/bin/pip install --quiet --no-deps /wheels/*.whl \
 && /opt/waydrop/bin/pip uninstall --quiet --yes pip setuptools \
 && /opt/waydrop/bin/python -m compileall -q /opt/waydrop/lib

FROM ${PYTHON_IMAGE}
LABEL org.opencontainers.image.title="Waydrop" \
      org.opencontainers.image.description="From a delivery plan to a proven drop, over MAVLink" \
      org.opencontainers.image.licenses="Apache-2.0"
COPY --from=wheel /opt/waydrop /opt/waydrop
COPY plans /opt/waydrop/share/plans
RUN useradd --uid 10001 --home-dir /var/lib/waydrop --create-home waydrop && mkdir -p /run/secrets
# 0.0.0.0 is refused without an access token: give WAYDROP_BOOTSTRAP_TOKEN
ENV PATH=/opt/waydrop/bin:$PATH \
    WAYDROP_HOST=0.0.0.0 \
    WAYDROP_PORT=8080 \
    WAYDROP_CONNECTIONS=udpin://0.0.0.0:14540 \
    WAYDROP_DATA_DIR=/var/lib/waydrop \
    WAYDROP_SECRETS_DIR=/run/secrets \
    WAYDROP_LOG_FORMAT=json
USER 10001
WORKDIR /var/lib/waydrop
VOLUME /var/lib/waydrop
EXPOSE 8080/tcp 14540/udp
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=15s --timeout=10s --start-period=15s --retries=3 CMD ["waydrop", "health"]
ENTRYPOINT ["waydrop"]
CMD ["serve"]
